// @ts-check
// The light seen from above: drag it, or move it by the arrow keys.
import { axes_of, direction_of } from "./light.js";
import { scale } from "./vector.js";

/** @typedef {import("./vector.js").Vec3} Vec3 */
/** @typedef {import("./light.js").Light} Light */
/** @typedef {import("./scene.js").Source} Source */

/** Steps of an arrow key across the pad; with Shift a step is as wide as ten. */
const KEY_STEPS = 80;

export class LightPad {
  /** @type {Source | null} */
  #source = null;
  /** @type {Light | null} */
  #light = null;

  /** @param {HTMLCanvasElement} canvas @param {(position: Vec3) => void} moved */
  constructor(canvas, moved) {
    this.canvas = canvas;
    this.moved = moved;
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.#movable) return;
      canvas.setPointerCapture(event.pointerId);
      this.#drag(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.#movable && canvas.hasPointerCapture(event.pointerId)) this.#drag(event);
    });
    canvas.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.draw()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  get #movable() {
    return this.#source !== null && this.#source.fixed_light === "";
  }

  /** @param {Source} source @param {Light} light */
  show(source, light) {
    this.#source = source;
    this.#light = light;
    const at = light.position.map((value) => Number(value.toPrecision(3)));
    this.canvas.setAttribute("aria-label", `Light from above, at x ${at[0]}, height ${at[1]}, z ${at[2]}. Arrow keys move it, Page Up and Page Down change its height.`);
    this.canvas.setAttribute("aria-disabled", String(source.fixed_light !== ""));
    this.draw();
  }

  /** @param {PointerEvent} event */
  #drag(event) {
    if (!this.#source || !this.#light) return;
    const { middle, reach } = this.#source.room;
    const box = this.canvas.getBoundingClientRect();
    const across = (/** @type {number} */ share) => (Math.min(Math.max(share, 0), 1) * 2 - 1) * reach;
    const x = middle[0] + across((event.clientX - box.left) / box.width);
    const z = middle[2] + across((event.clientY - box.top) / box.height);
    this.moved([x, this.#light.position[1], z]);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (!this.#source || !this.#light || !this.#movable) return;
    const { reach, low, high } = this.#source.room;
    const side = ((2 * reach) / KEY_STEPS) * (event.shiftKey ? 10 : 1);
    const up = ((high - low) / KEY_STEPS) * (event.shiftKey ? 10 : 1);
    /** @type {Record<string, Vec3>} */
    const steps = {
      ArrowLeft: [-side, 0, 0], ArrowRight: [side, 0, 0], ArrowUp: [0, 0, -side], ArrowDown: [0, 0, side],
      PageUp: [0, up, 0], PageDown: [0, -up, 0],
    };
    const step = steps[event.key];
    if (!step) return;
    event.preventDefault();
    const at = this.#light.position;
    this.moved([at[0] + step[0], at[1] + step[1], at[2] + step[2]]);
  }

  draw() {
    if (!this.#source || !this.#light) return;
    const ratio = devicePixelRatio || 1;
    const side = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    this.canvas.width = side;
    this.canvas.height = side;
    const context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext("2d"));
    const style = getComputedStyle(this.canvas);
    const colour = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    const { middle, reach } = this.#source.room;
    const to = (/** @type {Vec3} */ p) => [((p[0] - middle[0]) / reach + 1) * 0.5 * side, ((p[2] - middle[2]) / reach + 1) * 0.5 * side];
    const line = (/** @type {Vec3[]} */ points) => {
      context.beginPath();
      points.forEach((point, i) => (i === 0 ? context.moveTo(.../** @type {[number, number]} */ (to(point))) : context.lineTo(.../** @type {[number, number]} */ (to(point)))));
    };
    context.lineWidth = ratio;
    this.#draw_objects(context, line, colour);
    this.#draw_camera(context, line, colour);
    this.#draw_light(context, line, to, colour, ratio);
  }

  /** @param {CanvasRenderingContext2D} context @param {(points: Vec3[]) => void} line @param {(name: string) => string} colour */
  #draw_objects(context, line, colour) {
    for (const { quad, casts } of this.#source?.objects ?? []) {
      if (!quad) continue;
      const { center, half_u, half_v } = quad;
      const corner = (/** @type {number} */ s, /** @type {number} */ t) => /** @type {Vec3} */ (center.map((/** @type {number} */ c, /** @type {number} */ i) => c + s * half_u[i] + t * half_v[i]));
      line([corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)]);
      context.closePath();
      context.globalAlpha = casts === false ? 1 : 0.35;
      context.strokeStyle = colour("--line");
      context.fillStyle = colour(casts === false ? "--surface" : "--muted");
      context.fill();
      if (casts === false) context.stroke();
    }
    context.globalAlpha = 1;
  }

  /** @param {CanvasRenderingContext2D} context @param {(points: Vec3[]) => void} line @param {(name: string) => string} colour */
  #draw_camera(context, line, colour) {
    const source = /** @type {Source} */ (this.#source);
    if (source.kind !== "camera") return;
    // The width of the view follows the image; a square one stands for it.
    const half = Math.tan((source.receivers.camera.vertical_fov_deg * Math.PI) / 360);
    const far = 2 * source.room.reach;
    line([[-half * far, 0, -far], [0, 0, 0], [half * far, 0, -far]]);
    context.strokeStyle = colour("--muted");
    context.stroke();
  }

  /** @param {CanvasRenderingContext2D} context @param {(points: Vec3[]) => void} line @param {(point: Vec3) => number[]} to
   * @param {(name: string) => string} colour @param {number} ratio */
  #draw_light(context, line, to, colour, ratio) {
    const light = /** @type {Light} */ (this.#light);
    const { u, v } = axes_of(direction_of(light));
    const [x, y] = to(light.position);
    context.strokeStyle = colour("--accent");
    context.setLineDash([4 * ratio, 4 * ratio]);
    line([light.position, light.target]);
    context.stroke();
    context.setLineDash([]);
    context.fillStyle = colour("--accent");
    context.globalAlpha = 0.3;
    const half = light.kind === "rectangle" ? [scale(u, light.width / 2), scale(v, light.length / 2)] : null;
    if (half) {
      const corner = (/** @type {number} */ s, /** @type {number} */ t) => /** @type {Vec3} */ (light.position.map((c, i) => c + s * half[0][i] + t * half[1][i]));
      line([corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)]);
      context.closePath();
    } else {
      const edge = to([light.position[0] + (light.kind === "sphere" ? light.radius : 0), 0, light.position[2]]);
      context.beginPath();
      context.arc(x, y, edge[0] - x, 0, 2 * Math.PI);
    }
    context.fill();
    context.globalAlpha = 1;
    context.beginPath();
    context.arc(x, y, 6 * ratio, 0, 2 * Math.PI);
    context.fill();
    context.lineWidth = 2 * ratio;
    context.strokeStyle = colour("--ground");
    context.stroke();
  }
}
