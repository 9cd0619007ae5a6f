// @ts-check
// Updates a second, over the last second of steady updates.

/** Updates further apart than this are separate changes, not movement. */
const GAP_MS = 500;

export class RateMeter {
  /** @type {number[]} */
  #times = [];

  /** Counts an update at a time in ms, and says the rate; nothing before there are five in a row. @param {number} now */
  tick(now) {
    if (this.#times.length > 0 && now - this.#times[this.#times.length - 1] > GAP_MS) this.#times = [];
    this.#times.push(now);
    while (this.#times.length > 2 && now - this.#times[0] > 1000) this.#times.shift();
    if (this.#times.length < 5) return "";
    return `${((1000 * (this.#times.length - 1)) / (now - this.#times[0])).toFixed(1)} updates/s`;
  }
}
