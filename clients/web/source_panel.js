// @ts-check
// What is lit: the bundled scene, or depth maps that are dropped or picked.
import { button, choice_field, element, number_field } from "./fields.js";
import { camera_source, courtyard_source, light_view_source } from "./scene.js";

/** @typedef {import("./scene.js").Source} Source */
/** @typedef {import("./client.js").Json} Json */
/** @typedef {"front" | "back" | "receiver" | "depth"} Role */

const ENCODINGS = {
  planar: "Planar: distance along the axis", radial: "Radial: distance to the camera", disparity: "Disparity: 1 / depth",
  window: "Depth buffer, 0 near to 1 far", reversed_window: "Depth buffer, 1 near to 0 far", normalized: "Normalized, 0 near to 1 far",
};
const RANGED = ["window", "reversed_window", "normalized"];
const ACCEPTED = ".exr,.png,.tif,.tiff,.pfm,.hdr";

/** A name that a part of a request may have: the file's own, where it is one.
 * @param {string} given @param {string} role @param {string[]} taken */
export function part_name(given, role, taken) {
  const kept = given.replaceAll(/[^A-Za-z0-9._-]/g, "_").replace(/^\.+/, "").slice(-128);
  const name = kept === "" || kept === "scene" ? role : kept;
  return taken.includes(name) ? `${role}_${name}`.slice(0, 128) : name;
}

/** Which file is which, by name, else by order.
 * @param {File[]} files @returns {Partial<Record<Role, File>>} */
export function roles_of(files) {
  if (files.length === 1) return { depth: files[0] };
  /** @type {Partial<Record<Role, File>>} */
  const roles = {};
  const rest = files.filter((file) => {
    const role = /back/i.test(file.name) ? "back" : /recei|floor|ground/i.test(file.name) ? "receiver" : /front|occlu/i.test(file.name) ? "front" : null;
    if (!role || roles[role]) return true;
    roles[role] = file;
    return false;
  });
  for (const role of /** @type {Role[]} */ (["front", "receiver", "back"])) if (!roles[role] && rest.length > 0) roles[role] = rest.shift();
  return roles;
}

export class SourcePanel {
  kind = "courtyard";
  /** @type {Partial<Record<Role, File>>} */
  files = {};
  /** @type {Json} */
  encoding = { kind: "planar" };
  fov_deg = 50;
  /** 0: measured. */
  distance = 0;

  /** @param {HTMLElement} place
   * @param {{use: (source: Source) => void, measure: (name: string, file: Blob, encoding: Json, fov_deg: number) => Promise<number>,
   *          failed: (error: unknown) => void}} page */
  constructor(place, page) {
    this.place = place;
    this.page = page;
    this.show();
  }

  show() {
    const pick = choice_field(
      { label: "Scene", name: "source", value: this.kind, options: [["courtyard", "Courtyard (bundled)"], ["camera", "One camera's depth pass"], ["light_view", "Depth seen from a light"]] },
      (kind) => {
        this.kind = kind;
        this.show();
        this.place.querySelector("select")?.focus();
        if (kind === "courtyard") this.page.use(courtyard_source());
      },
    );
    this.place.replaceChildren(pick.node);
    if (this.kind === "camera") this.place.append(...this.#camera());
    if (this.kind === "light_view") this.place.append(...this.#light_view());
    if (this.kind === "courtyard") this.place.append(element("p", { className: "help" }, "Or drop depth maps anywhere on the page: EXR, PNG, TIFF or PFM."));
  }

  #camera() {
    return [
      element("p", { className: "help" }, "What the camera sees both casts and receives; what it does not see casts no shadow."),
      this.#file("depth", "Depth pass"),
      number_field({ label: "Vertical field of view", name: "fov", value: this.fov_deg, min: 0.1, max: 179, unit: "degrees" }, (value) => (this.fov_deg = value)).node,
      ...this.#common(),
    ];
  }

  #light_view() {
    return [
      element("p", { className: "help" }, "All from the light's centre, square. A back map counts where the technique's keys ask for it."),
      this.#file("front", "Occluders, front"), this.#file("back", "Occluders, back (optional)"), this.#file("receiver", "Receivers"),
      number_field({ label: "Field of view", name: "fov", value: this.fov_deg, min: 0.1, max: 179, unit: "degrees" }, (value) => (this.fov_deg = value)).node,
      ...this.#common(),
    ];
  }

  /** @param {Role} role @param {string} label */
  #file(role, label) {
    const input = element("input", { type: "file", accept: ACCEPTED, name: role, id: `file_${role}` });
    const chosen = element("p", { className: "help" }, this.files[role]?.name ?? "");
    input.addEventListener("change", () => {
      this.files[role] = input.files?.[0];
      chosen.textContent = this.files[role]?.name ?? "";
    });
    return element("div", { className: "field" }, element("label", { htmlFor: input.id }, label), element("div", { className: "control" }, input), chosen);
  }

  #common() {
    const ranged = RANGED.includes(this.encoding.kind);
    const set = (/** @type {string} */ key) => (/** @type {number} */ value) => (this.encoding = { ...this.encoding, [key]: value });
    const fields = [
      choice_field({ label: "Encoding", name: "encoding", value: this.encoding.kind, options: Object.entries(ENCODINGS) }, (kind) => {
        this.encoding = RANGED.includes(kind) ? { kind, near: this.encoding.near ?? 0.1, far: this.encoding.far ?? 100 } : { kind };
        this.show();
        /** @type {HTMLElement | null} */ (this.place.querySelector("[name=encoding]"))?.focus();
      }).node,
    ];
    if (ranged)
      fields.push(number_field({ label: "Near", name: "near", value: this.encoding.near, min: 0 }, set("near")).node,
        number_field({ label: "Far", name: "far", value: this.encoding.far, min: 0 }, set("far")).node);
    fields.push(number_field({ label: "Scale of depth", name: "scale", value: this.encoding.scale ?? 1, help: "multiplies the depth" }, set("scale")).node);
    fields.push(number_field(
      { label: "Distance of the subject", name: "distance", value: this.distance, min: 0, help: "in scene units, to place the light; 0: the median depth, measured by the service" },
      (value) => (this.distance = value)).node);
    return [...fields, button("Light it", () => this.apply(), "primary")];
  }

  /** Files that were dropped: sorted by their names and used. @param {File[]} files */
  drop(files) {
    if (files.length === 0) return;
    if (files.length > 3) return this.page.failed(new Error(`${files.length} files were dropped; expected one camera's depth, or front, back and receivers seen from a light`));
    this.files = roles_of(files);
    this.kind = files.length === 1 ? "camera" : "light_view";
    this.show();
    this.apply();
  }

  async apply() {
    try {
      this.page.use(await this.#source());
    } catch (error) {
      this.page.failed(error);
    }
  }

  /** @param {Role} role @param {string} what @returns {File} */
  #needed(role, what) {
    const file = this.files[role];
    if (!file) throw new Error(`${what}: no file is chosen`);
    return file;
  }

  async #source() {
    const encoding = { ...this.encoding };
    if (encoding.scale === 1) delete encoding.scale;
    const common = { encoding, vertical_fov_deg: this.fov_deg };
    const measured = (/** @type {string} */ name, /** @type {Blob} */ file) => (this.distance > 0 ? this.distance : this.page.measure(name, file, encoding, this.fov_deg));
    if (this.kind === "camera") {
      const file = this.#needed("depth", "Depth pass");
      const name = part_name(file.name, "depth", []);
      return camera_source({ ...common, name, file, distance: await measured(name, file) });
    }
    const front = this.#needed("front", "Occluders, front"), receiver = this.#needed("receiver", "Receivers"), back = this.files.back;
    const front_name = part_name(front.name, "front", []);
    const receiver_name = part_name(receiver.name, "receiver", [front_name]);
    const back_name = back ? part_name(back.name, "back", [front_name, receiver_name]) : "";
    return light_view_source({
      front: [front_name, front], receiver: [receiver_name, receiver], ...(back ? { back: [back_name, back] } : {}), encoding,
      tan_half_fov: Math.tan((this.fov_deg * Math.PI) / 360), distance: await measured(receiver_name, receiver),
    });
  }
}
