// @ts-check
// The same mask without the page: scene file, command lines, downloads.
import { button, element } from "./fields.js";

/** @typedef {import("./client.js").Json} Json */
/** @typedef {import("./client.js").Files} Files */
/** `bounds`: the technique has them. `picture`: the one that is shown under the light, and whether it has the mask's size.
 * @typedef {{scene: Json, files: Files, token: boolean, bounds: boolean, picture: {name: string, whole: boolean} | null}} State */

/** @typedef {{label: string, extension: string, media_type: string, image: import("./client.js").MaskImage}} Format */
/** @type {Format[]} */
export const FORMATS = [
  { label: "PNG, 16 bit", extension: "png", media_type: "image/png", image: "mask" },
  { label: "EXR", extension: "exr", media_type: "image/x-exr", image: "mask" },
  { label: "TIFF", extension: "tif", media_type: "image/tiff", image: "mask" },
  { label: "PFM", extension: "pfm", media_type: "image/x-portable-floatmap", image: "mask" },
];
/** @type {Format} */
const BOUND = { label: "Bounds, EXR", extension: "exr", media_type: "image/x-exr", image: "bound" };

/** One line a key, arrays on one line. @param {Json} scene */
export function scene_text(scene) {
  const inline = (/** @type {any} */ value) => JSON.stringify(value).replaceAll('":', '": ').replaceAll(/,(?=["{[\-\d])/g, ", ");
  const section = (/** @type {any} */ value) =>
    Array.isArray(value) ? `[\n${value.map((one) => `    ${inline(one)}`).join(",\n")}\n  ]` : inline(value);
  return `{\n${Object.entries(scene).map(([key, value]) => `  "${key}": ${section(value)}`).join(",\n")}\n}\n`;
}

/** @param {Files} files @param {string} origin @param {boolean} token */
export function curl_line(files, origin, token) {
  const parts = ["-F scene=@scene.json", ...[...files.keys()].map((name) => `-F ${name}=@${name}`)];
  const secret = token ? ' -H "Authorization: Bearer $PENUMBRA_SERVER_TOKEN"' : "";
  return `curl --fail-with-body${secret} -H 'Accept: image/x-exr' ${parts.join(" ")} ${origin}/v1/masks -o mask.exr`;
}

/** `picture` is laid under the mask where it has the mask's size: the command scales none. @param {State["picture"]} [picture] */
export const penumbra_line = (picture = null) => `penumbra mask scene.json -o mask.exr${picture?.whole ? ` --over '${picture.name.replaceAll("'", "'\\''")}' --preview preview.png` : ""}`;

/** @param {Blob} blob @param {string} name */
export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  element("a", { href: address, download: name }).click();
  // The browser has taken it by the next turn of its loop; a minute is plenty.
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}

/** Where it is another text: a light that moves changes few. @param {HTMLElement} node @param {string} text */
function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** @param {string} label @param {string} id @param {() => string} text @param {(said: string) => void} say */
function copyable(label, id, text, say) {
  const area = element("pre", { id, tabIndex: 0 });
  area.setAttribute("aria-label", label);
  const copy = button("Copy", async () => {
    try {
      await navigator.clipboard.writeText(text());
      say(`${label} copied`);
    } catch {
      // Browsers give the clipboard only to pages over HTTPS or on localhost: select it instead.
      getSelection()?.selectAllChildren(area);
      say("Selected: copy it with Ctrl+C");
    }
  }, "quiet");
  return { node: element("div", { className: "copyable" }, element("div", { className: "copy_head" }, element("h3", {}, label), copy), area), area };
}

export class SharePanel {
  /** @param {HTMLElement} place
   * @param {{state: () => State, download: (format: Format) => void, download_picture: () => void, say: (said: string) => void}} page */
  constructor(place, page) {
    this.page = page;
    this.scene = copyable("Scene file", "scene_text", () => scene_text(page.state().scene), page.say);
    this.curl = copyable("curl", "curl_line", () => this.#curl(), page.say);
    this.penumbra = copyable("Command line", "penumbra_line", () => penumbra_line(page.state().picture), page.say);
    const downloads = FORMATS.map((format) => button(format.label, () => page.download(format)));
    this.bound = button(BOUND.label, () => page.download(BOUND));
    this.bound.title = "The lowest and the highest visibility that each pixel can have: what lies behind the depth that was seen is a guess";
    this.picture = button("Picture, PNG", () => page.download_picture());
    const scene = button("scene.json", () => save(new Blob([scene_text(page.state().scene)], { type: "application/json" }), "scene.json"));
    const details = element("details", {}, element("summary", {}, "Show the scene file"), this.scene.node);
    this.details = details;
    details.addEventListener("toggle", () => this.refresh());
    place.append(
      element("h3", {}, "Download"),
      element("div", { className: "buttons", role: "group", ariaLabel: "Download" }, ...downloads, this.bound, this.picture, scene),
      element("p", { className: "help", id: "files_note" }), this.penumbra.node, this.curl.node, details,
    );
    this.note = /** @type {HTMLElement} */ (place.querySelector("#files_note"));
  }

  #curl() {
    const { files, token } = this.page.state();
    return curl_line(files, location.origin, token);
  }

  refresh() {
    const { scene, files, bounds, picture } = this.page.state();
    this.bound.hidden = !bounds;
    this.picture.hidden = picture === null;
    write(this.note, `The lines below take scene.json${files.size > 0 ? ` and, beside it, ${[...files.keys()].join(", ")}` : ""}.`);
    write(this.curl.area, this.#curl());
    write(this.penumbra.area, penumbra_line(picture));
    // Long, so only while it is seen.
    if (this.details.open) write(this.scene.area, scene_text(scene));
  }
}
