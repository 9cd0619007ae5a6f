// @ts-check
// What is seen: the masks with their names, what casts and the light over them, tables and warnings.
import { draw_casters } from "./casters.js";
import { error_table, stage_table } from "./figures.js";
import { draw_light } from "./light_outline.js";
import { compare } from "./metrics.js";
import { show_picture_choice } from "./picture_choice.js";

/** @typedef {import("./light.js").Light} Light */
/** @typedef {import("./follower.js").State} State */

/** Tables follow a moving light this often: nobody reads them faster. */
const FIGURES_MS = 250;
/** The drawing over the mask follows as often as masks come at best. */
const OVERLAY_MS = 40;

const by_id = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

export class Stage {
  #figures_timer = 0;
  #overlay_timer = 0;
  #overlay_drawn = -Infinity;

  /** @param {import("./view.js").View} view @param {import("./follower.js").Follower} follower
   * @param {{state: () => State, light: () => Light}} page */
  constructor(view, follower, page) {
    this.view = view;
    this.follower = follower;
    this.page = page;
    new ResizeObserver(() => this.show_overlay()).observe(by_id("frame"));
    for (const id of ["casters", "light_drawn"]) by_id(id).addEventListener("change", () => this.show_overlay());
  }

  /** All of it: a mask has come, or what is shown of it is another. */
  show() {
    const { view } = this;
    view.draw();
    const frame = by_id("frame");
    if (view.a) frame.parentElement.style.setProperty("--aspect", String(view.a.width / view.a.height));
    frame.style.setProperty("--wipe", String(view.wipe));
    by_id("divider").hidden = by_id("wipe_row").hidden = view.mode !== "wipe";
    by_id("legend").hidden = view.mode !== "difference";
    by_id("b_section").hidden = view.mode === "mask";
    show_picture_choice(view);
    this.show_names();
    this.#figures_timer ||= setTimeout(() => this.#show_figures(), FIGURES_MS);
  }

  /** Which mask this is, and whether it is that of what is asked for. */
  show_names() {
    const { follower: { shown, stale, version }, view } = this;
    const { b, draft, eased } = this.page.state();
    const comparing = view.mode !== "mask";
    const stale_b = shown.b_version !== version;
    const frame = by_id("frame");
    frame.classList.toggle("stale", stale.late || (view.mode === "difference" && stale_b));
    frame.classList.toggle("other", stale.other || shown.refused);
    frame.classList.toggle("stale_b", view.mode === "wipe" && shown.b !== null && stale_b);
    const earlier = stale.other && shown.a !== null;
    by_id("name_a").hidden = !comparing && draft === null && !shown.draft && !earlier && !eased;
    by_id("name_a").textContent = `${comparing ? "A  " : ""}${this.#name_of_a(earlier)}`;
    by_id("name_b").hidden = !comparing;
    by_id("name_b").textContent = `B  ${b.kind}${shown.b === null ? ": to come" : stale_b ? ": earlier" : ""}`;
  }

  /** @param {boolean} earlier */
  #name_of_a(earlier) {
    const { shown } = this.follower;
    const { a, eased } = this.page.state();
    const kind = shown.a_of?.choice.kind ?? a.kind;
    if (earlier) return `${kind}: earlier`;
    const small = shown.a_of?.source.small;
    const size = small ? ` at ${small.size.join(" x ")}` : "";
    const full = kind === a.kind ? "in full" : a.kind;
    if (shown.draft) return `${kind}: draft${size}; ${full} when the light rests`;
    return eased ? `${kind} with a map of ${a.settings.resolution} x ${a.settings.resolution}: the light touches a caster` : kind;
  }

  /** With the browser's next frame, and not with every one: the service may need the same processor. */
  show_overlay() {
    if (this.#overlay_timer) return;
    const rest = this.#overlay_drawn + OVERLAY_MS - performance.now();
    this.#overlay_timer = setTimeout(() => requestAnimationFrame(() => this.#draw_overlay()), Math.max(0, rest));
  }

  /** What casts, where the page knows it, and the light. */
  #draw_overlay() {
    this.#overlay_timer = 0;
    this.#overlay_drawn = performance.now();
    const overlay = by_id("overlay");
    const ratio = devicePixelRatio || 1;
    overlay.width = Math.max(1, Math.round(overlay.clientWidth * ratio));
    overlay.height = Math.max(1, Math.round(overlay.clientHeight * ratio));
    const { source } = this.page.state();
    const { camera } = source.receivers;
    const light = this.page.light();
    const drawable = source.objects.some((object) => object.quad);
    by_id("casters_label").hidden = !drawable;
    by_id("light_drawn_label").hidden = camera.kind !== "pinhole";
    if (camera.kind !== "pinhole" || this.view.mode === "difference") return;
    const context = overlay.getContext("2d");
    if (drawable && by_id("casters").checked) draw_casters(context, source.objects, camera, light.position);
    if (by_id("light_drawn").checked) draw_light(context, light, camera, getComputedStyle(overlay).getPropertyValue("--lamp").trim());
  }

  #show_figures() {
    this.#figures_timer = 0;
    const { follower: { shown, version }, view } = this;
    const fresh_b = view.mode !== "mask" && shown.b !== null && shown.b_version === version && !shown.draft;
    const a = `${shown.a_of?.choice.kind}${shown.draft ? ", draft" : ""}`;
    const b = shown.b_of?.choice.kind ?? "";
    const tables = [];
    if (fresh_b && view.comparable && view.a && view.b) tables.push(error_table(compare(view.a, view.b), a, b));
    if (shown.a) tables.push(stage_table(view.mode === "mask" ? a : `A  ${a}`, shown.a.stages, shown.a.ms));
    if (fresh_b && shown.b) tables.push(stage_table(`B  ${b}`, shown.b.stages, shown.b.ms));
    by_id("figures").replaceChildren(...tables);
    const warnings = (shown.a?.warnings ?? []).map((text) => Object.assign(document.createElement("li"), { textContent: text }));
    by_id("warnings").replaceChildren(...warnings);
  }
}
