// @ts-check
// The light's controls: kind, sizes, place and aim.
import { choice_field, element, number_field } from "./fields.js";
import { LIGHT_KINDS } from "./light.js";
import { LightPad } from "./light_pad.js";

/** @typedef {import("./vector.js").Vec3} Vec3 */
/** @typedef {import("./light.js").Light} Light */
/** @typedef {import("./scene.js").Source} Source */

const SIZE_LABELS = { width: "Width", length: "Length", radius: "Radius", angular_diameter_deg: "Angular diameter" };

export class LightPanel {
  /** @type {((light: Light) => void)[]} what follows the light's position */
  #followers = [];

  /** @param {HTMLElement} place @param {(light: Light) => void} changed */
  constructor(place, changed) {
    this.place = place;
    this.changed = changed;
    this.canvas = element("canvas", { className: "pad", tabIndex: 0, id: "light_pad" });
    this.canvas.setAttribute("role", "application");
    this.pad = new LightPad(this.canvas, (position) => this.#change({ position }));
  }

  /** @param {Source} source @param {Light} light */
  show(source, light) {
    this.source = source;
    this.light = light;
    this.#followers = [];
    const kinds = choice_field(
      { label: "Kind", name: "light_kind", value: light.kind, options: source.lights.map((kind) => [kind, LIGHT_KINDS[kind].label]) },
      (kind) => {
        this.#change({ kind });
        this.show(source, /** @type {Light} */ (this.light));
        /** @type {HTMLElement | null} */ (this.place.querySelector("select"))?.focus();
      },
    );
    const fixed = element("p", { className: "notice", id: "fixed_light" }, source.fixed_light);
    const movement = source.fixed_light ? [fixed] : this.#movement(source, light);
    // What moves it comes first: it is in sight beside the picture, on a tablet as well.
    this.place.replaceChildren(...movement, kinds.node, ...this.#sizes(source, light), ...(source.fixed_light ? [] : [this.#numbers(light)]));
    this.pad.show(source, light);
  }

  /** Shows a light that something else has moved. @param {Light} light */
  follow(light) {
    this.light = light;
    for (const follow of this.#followers) follow(light);
    this.pad.show(/** @type {Source} */ (this.source), light);
  }

  /** @param {Partial<Light>} part */
  #change(part) {
    this.follow({ .../** @type {Light} */ (this.light), ...part });
    this.changed(/** @type {Light} */ (this.light));
  }

  /** @param {Source} source @param {Light} light */
  #sizes(source, light) {
    return LIGHT_KINDS[light.kind].sizes.map((key) => {
      const angle = key === "angular_diameter_deg";
      // Up to a quarter of the room; the field takes more than the slider only where the file does.
      const max = angle ? 60 : Number((source.room.reach / 2).toPrecision(2));
      const label = SIZE_LABELS[/** @type {keyof SIZE_LABELS} */ (key)];
      const value = Number(/** @type {number} */ (light[key]).toPrecision(4));
      return number_field(
        { label, name: `light_${key}`, value, min: 0, max, step: "any", unit: angle ? "degrees" : "", slider: true },
        (size) => this.#change({ [key]: size }),
      ).node;
    });
  }

  /** @param {Source} source @param {Light} light */
  #movement(source, light) {
    const { low, high } = source.room;
    const height = element("input", { type: "range", min: String(low), max: String(high), step: "any", id: "light_height", className: "upright" });
    height.setAttribute("aria-label", "Height of the light");
    height.setAttribute("orient", "vertical");
    height.addEventListener("input", () => {
      const at = /** @type {Light} */ (this.light).position;
      this.#change({ position: [at[0], height.valueAsNumber, at[2]] });
    });
    const follow = (/** @type {Light} */ now) => (height.value = String(now.position[1]));
    follow(light);
    this.#followers.push(follow);
    const caption = light.kind === "directional" ? "Seen from above; only the direction to the aim counts." : "Seen from above. Drag, or use the arrow keys.";
    return [
      element("div", { className: "pad_row" }, this.canvas, element("div", { className: "height" }, height, element("span", { className: "help" }, "height"))),
      element("p", { className: "help pad_help" }, caption),
    ];
  }

  /** @param {Light} light */
  #numbers(light) {
    return element("details", {}, element("summary", {}, "Numbers"), this.#triple("Position", "position", light), this.#triple("Aim", "target", light));
  }

  /** @param {string} title @param {"position" | "target"} key @param {Light} light */
  #triple(title, key, light) {
    const fields = ["x", "y", "z"].map((axis, i) => {
      const field = number_field({ label: axis, name: `${key}_${axis}`, value: Number(light[key][i].toPrecision(5)) }, (value) => {
        const point = /** @type {Vec3} */ ([.../** @type {Light} */ (this.light)[key]]);
        point[i] = value;
        this.#change({ [key]: point });
      });
      field.control.setAttribute("aria-label", `${title} ${axis}`);
      this.#followers.push((now) => field.set(now[key][i]));
      return field.node;
    });
    return element("fieldset", { className: "triple" }, element("legend", {}, title), ...fields);
  }
}
