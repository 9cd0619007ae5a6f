// @ts-check
// What is lit: the bundled scene, or depth maps that are dropped or picked, one camera's with its picture.
import { channel_label, channels_in } from "./channels.js";
import { button, choice_field, element, flag_field, number_field } from "./fields.js";
import { look_of, part_name, picture_among, roles_of } from "./files.js";
import { Picture } from "./picture.js";
import { camera_source, courtyard_source, light_view_source } from "./scene.js";

/** @typedef {import("./scene.js").Source} Source */
/** @typedef {import("./client.js").Json} Json */
/** @typedef {import("./files.js").Role} Role */

const ENCODINGS = {
  planar: "Planar: distance along the axis", radial: "Radial: distance to the camera", disparity: "Disparity: 1 / depth",
  window: "Depth buffer, 0 near to 1 far", reversed_window: "Depth buffer, 1 near to 0 far", normalized: "Normalized, 0 near to 1 far",
};
const RANGED = ["window", "reversed_window", "normalized"];
const ACCEPTED = ".exr,.png,.tif,.tiff,.pfm,.hdr";
const PICTURES = ".jpg,.jpeg,.png,image/*";

export class SourcePanel {
  kind = "courtyard";
  /** @type {Partial<Record<Role, File>>} */
  files = {};
  /** What was said of the picture: why it is taken for one. */
  look = "";
  /** The depth file that is lit. @type {File | undefined} */
  lit = undefined;
  /** @type {Json} */
  encoding = { kind: "planar" };
  fov_deg = 50;
  /** 0: measured. */
  distance = 0;
  /** What the depth may be in, where the service is not certain. @type {import("./channels.js").Channel[]} */
  channels = [];
  /** Counts what was to be lit: the last one is. */
  #wanted = 0;

  /** @param {HTMLElement} place
   * @param {{use: (source: Source) => void, use_picture: (picture: Picture | null) => void, look: (name: string, file: Blob, encoding: Json, fov_deg: number) => Promise<import("./depth_view.js").DepthView>,
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
        this.lit = undefined;
        if (kind !== "courtyard") return;
        this.#wanted++;
        this.page.use(courtyard_source());
      },
    );
    this.place.replaceChildren(pick.node);
    if (this.kind === "camera") this.place.append(...this.#camera());
    if (this.kind === "light_view") this.place.append(...this.#light_view());
    if (this.kind === "courtyard") this.place.append(element("p", { className: "help" }, "Or drop depth maps anywhere on the page: EXR, PNG, TIFF or PFM. One camera's depth may come with its picture, a JPEG or PNG."));
  }

  #camera() {
    return [
      element("p", { className: "help" }, "What the camera sees both casts and receives; what it does not see casts no shadow."),
      this.#file("depth", "Depth pass"), this.#picture(),
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
      if (this.channels.length === 0) return;
      this.#forget_channels();
      this.show();
    });
    return element("div", { className: "field" }, element("label", { htmlFor: input.id }, label), element("div", { className: "control" }, input), chosen);
  }

  /** The picture's field: it is shown at once over the depth that is lit. */
  #picture() {
    const { picture, depth } = this.files;
    const input = element("input", { type: "file", accept: PICTURES, name: "picture", id: "file_picture" });
    const field = element("div", { className: "field" }, element("label", { htmlFor: input.id }, "Picture (optional)"), element("div", { className: "control" }, input));
    const said = picture ? `${picture.name}${this.look ? `, a ${this.look}` : ""}: taken as the picture. The depth is ${depth?.name ?? "still missing"}.` : "What the depth shows, to see it under the new light: JPEG or PNG.";
    field.append(element("p", { className: "help", id: "picture_said" }, said));
    input.addEventListener("change", async () => {
      this.files.picture = input.files?.[0];
      this.look = this.files.picture ? await look_of(this.files.picture) : "";
      this.show();
      if (depth && this.lit === depth) await this.#show_picture();
    });
    if (picture && depth) field.append(button("Swap picture and depth", () => {
      this.files = { ...this.files, depth: picture, picture: depth };
      this.look = "";
      this.show();
      this.apply();
    }, "quiet"));
    return field;
  }

  /** Lays the picture over the depth that is lit already. */
  async #show_picture() {
    try {
      const { picture } = this.files;
      this.page.use_picture(picture ? await Picture.read(picture) : null);
    } catch (error) {
      this.page.failed(error);
    }
  }

  #common() {
    const ranged = RANGED.includes(this.encoding.kind);
    const { channel, part } = this.encoding;
    const chosen = channel === undefined ? {} : { channel, ...(part === undefined ? {} : { part }) };
    const set = (/** @type {string} */ key) => (/** @type {number} */ value) => (this.encoding = { ...this.encoding, [key]: value });
    const fields = [
      ...this.#channel(),
      choice_field({ label: "Encoding", name: "encoding", value: this.encoding.kind, options: Object.entries(ENCODINGS) }, (kind) => {
        this.encoding = { kind, ...(RANGED.includes(kind) ? { near: this.encoding.near ?? 0.1, far: this.encoding.far ?? 100 } : {}), ...chosen };
        this.show();
        /** @type {HTMLElement | null} */ (this.place.querySelector("[name=encoding]"))?.focus();
      }).node,
    ];
    if (ranged)
      fields.push(number_field({ label: "Near", name: "near", value: this.encoding.near, min: 0 }, set("near")).node,
        number_field({ label: "Far", name: "far", value: this.encoding.far, min: 0 }, set("far")).node);
    const disparity = this.encoding.kind === "disparity";
    const meaning = disparity ? "multiplies the disparity" : "multiplies the depth";
    fields.push(number_field({ label: disparity ? "Scale" : "Scale of depth", name: "scale", value: this.encoding.scale ?? 1, help: meaning }, set("scale")).node);
    if (disparity) fields.push(number_field({ label: "Shift", name: "shift", value: this.encoding.shift ?? 0, help: "1 / depth = scale x value + shift" }, set("shift")).node);
    if (ranged || disparity) fields.push(flag_field({ label: "0 is a hole", name: "empty", value: this.encoding.empty === 0, help: "pixels with the value 0 show nothing" }, (holes) => {
      const { empty, ...rest } = this.encoding;
      this.encoding = holes ? { ...rest, empty: 0 } : rest;
    }).node);
    fields.push(number_field(
      { label: "Distance of the subject", name: "distance", value: this.distance, min: 0, help: "in scene units, to place the light; 0: the median depth" },
      (value) => (this.distance = value)).node);
    return [...fields, button("Light it", () => this.apply(), "primary")];
  }

  /** Which channel is depth, where the service could not tell. */
  #channel() {
    if (this.channels.length === 0) return [];
    const at = this.channels.findIndex(({ channel, part }) => channel === this.encoding.channel && part === this.encoding.part);
    const options = this.channels.map((one, i) => /** @type {[string, string]} */ ([String(i), channel_label(one)]));
    return [choice_field({ label: "Channel", name: "channel", value: String(at), options: at < 0 ? [["-1", "choose ..."], ...options] : options, help: "the one that holds the depth" }, (index) => {
      const { channel: _, part: __, ...rest } = this.encoding;
      this.encoding = { ...rest, ...this.channels[Number(index)] };
      this.show();
      this.apply();
    }).node];
  }

  /** Channels of the last file are none of the next. */
  #forget_channels() {
    const { channel: _, part: __, ...rest } = this.encoding;
    this.encoding = rest;
    this.channels = [];
  }

  /** Files that were dropped: sorted by what they hold and by their names, and used. @param {File[]} files */
  async drop(files) {
    if (files.length === 0) return;
    try {
      await this.#take(files);
    } catch (error) {
      this.page.failed(error);
    }
  }

  /** @param {File[]} files */
  async #take(files) {
    const { depth, picture, look } = await picture_among(files);
    if (depth.length > 3 || (picture && depth.length > 1))
      throw new Error(`${files.length} files were dropped; expected one camera's depth, perhaps with its picture, or front, back and receivers seen from a light`);
    const light_view = depth.length > 1;
    // A picture by itself belongs to the depth that is there, and depth by itself to a picture that has none yet.
    const waiting = this.files.depth ? undefined : this.files.picture;
    const kept = depth.length === 0 ? this.files.depth : undefined;
    this.files = light_view ? roles_of(depth) : { depth: depth[0] ?? kept, picture: picture ?? waiting };
    if (picture) this.look = look;
    this.kind = light_view ? "light_view" : "camera";
    if (depth.length > 0) this.#forget_channels();
    this.show();
    if (kept && this.lit === kept) return this.#show_picture();
    if (!light_view && !this.files.depth) throw new Error(`${picture?.name} is taken as a picture, a ${look}. Its depth image is missing: drop it, too, or choose it under Scene.`);
    await this.apply();
  }

  async apply() {
    const wanted = ++this.#wanted;
    try {
      const source = await this.#source();
      if (wanted === this.#wanted) this.page.use(source);
    } catch (error) {
      if (wanted !== this.#wanted) return;
      this.page.failed(this.#offer_channels(error));
    }
  }

  /** Where the service says that it may be one of several channels, they are there to choose from, and the error says so. @param {unknown} error */
  #offer_channels(error) {
    const channels = channels_in(error instanceof Error ? error.message : "");
    if (channels.length === 0) return error;
    this.channels = channels;
    this.show();
    /** @type {HTMLElement | null} */ (this.place.querySelector("[name=channel]"))?.focus();
    return new Error(`${/** @type {Error} */ (error).message}. Choose it under Scene, Channel.`);
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
    if (encoding.shift === 0) delete encoding.shift;
    const common = { encoding, vertical_fov_deg: this.fov_deg };
    const look = (/** @type {string} */ name, /** @type {Blob} */ file) => this.page.look(name, file, encoding, this.fov_deg);
    if (this.kind === "camera") {
      const file = this.#needed("depth", "Depth pass");
      const name = part_name(file.name, "depth", []);
      const picture = this.files.picture ? await Picture.read(this.files.picture) : null;
      const view = await look(name, file);
      const source = camera_source({ ...common, name, file, distance: this.distance || view.median, picture, view });
      this.lit = file;
      return source;
    }
    const front = this.#needed("front", "Occluders, front"), receiver = this.#needed("receiver", "Receivers"), back = this.files.back;
    const front_name = part_name(front.name, "front", []);
    const receiver_name = part_name(receiver.name, "receiver", [front_name]);
    const back_name = back ? part_name(back.name, "back", [front_name, receiver_name]) : "";
    return light_view_source({
      front: [front_name, front], receiver: [receiver_name, receiver], ...(back ? { back: [back_name, back] } : {}), encoding,
      tan_half_fov: Math.tan((this.fov_deg * Math.PI) / 360), distance: this.distance || (await look(receiver_name, receiver)).median,
    });
  }
}
