// @ts-check
// What is being computed, and for how long: a sign for what takes longer than a glance.

/** Shorter work is not worth a sign, and a gap as short does not take it away. */
const GLANCE_MS = 200;

export class Busy {
  /** What is on its way, and since when. @type {Map<symbol, {name: string, begun: number}>} */
  #jobs = new Map();
  #timer = 0;
  #ended = -Infinity;

  /** @param {HTMLElement} node */
  constructor(node) {
    this.node = node;
  }

  /** Something begins; the function that it returns ends it. @param {string} name */
  begin(name) {
    const job = Symbol(name);
    this.#jobs.set(job, { name, begun: performance.now() });
    this.#timer ||= setInterval(() => this.#show(), GLANCE_MS);
    return () => {
      this.#jobs.delete(job);
      this.#ended = performance.now();
    };
  }

  #show() {
    const now = performance.now();
    const [first] = this.#jobs.values();
    if (!first) {
      if (now - this.#ended < GLANCE_MS) return;
      clearInterval(this.#timer);
      this.#timer = 0;
      this.node.hidden = true;
      return;
    }
    const took = now - first.begun;
    if (took < GLANCE_MS) return;
    const seconds = Math.floor(took / 1000);
    this.node.textContent = `${first.name}${seconds >= 1 ? `, ${seconds} s` : ""}`;
    this.node.hidden = false;
  }
}
