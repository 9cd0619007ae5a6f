// @ts-check
// Latest wins: one job at a time, and of those that come meanwhile only the last is kept.

export class LatestQueue {
  /** @type {(() => Promise<void>) | null} */
  #next = null;
  #running = false;

  get busy() {
    return this.#running;
  }

  /** Runs the job when none is running, else after the one that is, unless a later one takes its place. Jobs deal with their own errors.
   * @param {() => Promise<void>} job */
  push(job) {
    this.#next = job;
    if (!this.#running) this.#drain();
  }

  async #drain() {
    this.#running = true;
    try {
      while (this.#next) {
        const job = this.#next;
        this.#next = null;
        await job();
      }
    } finally {
      this.#running = false;
    }
  }
}
