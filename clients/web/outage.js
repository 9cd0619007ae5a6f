// @ts-check
// The service does not answer, or is busy: waits, longer each time, says for how long, and is over when an answer comes.
import { NoAnswer, ServiceError } from "./client.js";

/** The longest wait that nobody asked for. */
export const LONGEST_S = 15;

export class Outage {
  #tries = 0;
  /** @type {Promise<void> | null} */
  #wait = null;

  /** @param {(text: string) => void} say what is to be read meanwhile; nothing: it is over
   * @param {(ms: number) => Promise<void>} [sleep] */
  constructor(say, sleep = (ms) => new Promise((then) => setTimeout(then, ms))) {
    this.say = say;
    this.sleep = sleep;
  }

  get waiting() {
    return this.#wait !== null;
  }

  /** Whether to ask again is all that helps. @param {unknown} error */
  static is(error) {
    return error instanceof NoAnswer || (error instanceof ServiceError && error.status === 503);
  }

  /** Until it is time to ask again: one wait for all who ask. @param {unknown} error one that is() takes */
  wait(error) {
    this.#wait ??= this.#count_down(error).finally(() => (this.#wait = null));
    return this.#wait;
  }

  /** An answer came. */
  over() {
    if (this.#tries === 0) return;
    this.#tries = 0;
    this.say("");
  }

  /** @param {unknown} error */
  async #count_down(error) {
    const told = error instanceof ServiceError ? error.retry_after_s : 0;
    const seconds = told > 0 ? told : Math.min(2 ** this.#tries, LONGEST_S);
    this.#tries++;
    const what = error instanceof NoAnswer ? "The service does not answer" : `The service has no time: ${/** @type {Error} */ (error).message}`;
    for (let left = seconds; left > 0; left--) {
      this.say(`${what}; trying again in ${Math.ceil(left)} s`);
      await this.sleep(1000 * Math.min(left, 1));
    }
    this.say(`${what}; trying again now`);
  }
}
