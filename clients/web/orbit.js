// @ts-check
// The light on a part of a circle about its target, with every frame of the browser.

/** @typedef {import("./light.js").Light} Light */

export class Orbit {
  #frame = 0;

  /** @param {HTMLButtonElement} button pressed while it moves @param {{light: () => Light, moved: (light: Light) => void}} page */
  constructor(button, page) {
    this.button = button;
    this.page = page;
    button.addEventListener("click", () => (this.#frame ? this.stop() : this.#start()));
  }

  stop() {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    this.button.setAttribute("aria-pressed", "false");
  }

  #start() {
    const begun = performance.now();
    const { position, target } = this.page.light();
    const [x, z] = [position[0] - target[0], position[2] - target[2]];
    const step = (/** @type {number} */ now) => {
      const turn = 0.35 * Math.sin((now - begun) / 1500);
      const [c, s] = [Math.cos(turn), Math.sin(turn)];
      this.page.moved({ ...this.page.light(), position: [target[0] + c * x - s * z, position[1], target[2] + s * x + c * z] });
      this.#frame = requestAnimationFrame(step);
    };
    this.#frame = requestAnimationFrame(step);
    this.button.setAttribute("aria-pressed", "true");
  }
}
