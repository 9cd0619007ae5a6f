// @ts-check
// The page: one state, one queue of requests, and the panels that change the one and show the other.
import { draw_casters } from "./casters.js";
import { Client, ServiceError } from "./client.js";
import { choice_field } from "./fields.js";
import { error_table, stage_table } from "./figures.js";
import { LightPanel } from "./light_panel.js";
import { compare } from "./metrics.js";
import { decode_pfm } from "./pfm.js";
import { median_depth } from "./probe.js";
import { LatestQueue } from "./queue.js";
import { RateMeter } from "./rate.js";
import { courtyard_source, scene_json } from "./scene.js";
import { save, SharePanel } from "./share_panel.js";
import { SourcePanel } from "./source_panel.js";
import { suggested_choice, technique_panel } from "./technique_panel.js";
import { View } from "./view.js";

/** @typedef {import("./scene.js").Source} Source */
/** @typedef {import("./technique_panel.js").Choice} Choice */
/** @typedef {import("./client.js").MaskReply} MaskReply */

const PFM = "image/x-portable-floatmap";
/** What the page opens with, where the service knows it; else the service's first. */
const FIRST = { a: "soft_shadow_map", b: "ray_traced" };
/** The second mask follows the light at once when it takes less than this; else when the light has rested that long. */
const FOLLOWS_MS = 150;
/** Tables follow a moving light this often: nobody reads them faster. */
const FIGURES_MS = 250;
/** How long a message stays. */
const SAID_MS = 4000;

const by_id = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

const client = new Client();
const queue = new LatestQueue();
const view = new View(by_id("mask"));
const rate = new RateMeter();
/** @type {import("./client.js").Technique[]} */
let techniques = [];
/** @type {Source} */
let source = courtyard_source();
let light = source.light;
/** @type {Choice} */
let a = { kind: FIRST.a, settings: {} };
/** @type {Choice} */
let b = { kind: FIRST.b, settings: {} };
/** Counts changes: a mask belongs to one. */
let version = 0;
/** @type {{a: MaskReply | null, b: MaskReply | null, b_version: number}} */
const shown = { a: null, b: null, b_version: -1 };
let rest_timer = 0, figures_timer = 0;

let said_timer = 0;

/** @param {string} text */
function say(text) {
  by_id("said").textContent = text;
  clearTimeout(said_timer);
  said_timer = setTimeout(() => (by_id("said").textContent = ""), SAID_MS);
}

/** @param {unknown} error @param {string} [whose] */
function fail(error, whose = "") {
  if (error instanceof ServiceError && error.status === 401) {
    by_id("token_form").hidden = false;
    by_id("token").focus();
  }
  const box = by_id("problem");
  box.textContent = `${whose}${error instanceof Error ? error.message : String(error)}`;
  box.hidden = false;
}

/** @param {Choice} choice @returns {Promise<MaskReply>} */
const ask = (choice) => client.mask(scene_json(source, light, choice), source.files, PFM);

/** True when the service was busy and the job will be tried again. @param {unknown} error @param {() => void} again */
function waits(error, again) {
  if (!(error instanceof ServiceError && error.status === 503)) return false;
  setTimeout(again, 1000 * Math.max(1, error.retry_after_s));
  return true;
}

async function update_a() {
  const asked = version;
  try {
    const reply = await ask(a);
    view.a = decode_pfm(reply.buffer);
    shown.a = reply;
    by_id("problem").hidden = true;
    by_id("rate").textContent = rate.tick(performance.now());
    // Announced to scripts and tests: this version of the state is on the screen.
    by_id("mask").dataset.version = String(asked);
  } catch (error) {
    if (waits(error, update)) return;
    shown.a = null;
    fail(error);
  }
  show_masks();
  if (view.mode !== "mask" && shown.b && shown.b.ms < FOLLOWS_MS && asked === version) await update_b();
}

async function update_b() {
  const asked = version;
  try {
    const reply = await ask(b);
    view.b = decode_pfm(reply.buffer);
    shown.b = reply;
    shown.b_version = asked;
    by_id("mask").dataset.versionB = String(asked);
  } catch (error) {
    if (waits(error, update)) return;
    view.b = null;
    shown.b = null;
    fail(error, `${b.kind}: `);
  }
  show_masks();
}

/** Asks for masks of the state as it is now. */
function update() {
  version++;
  queue.push(update_a);
  share.refresh();
  clearTimeout(rest_timer);
  if (view.mode === "mask") return;
  const asked = version;
  const when_rested = () => {
    // Without a first mask there is nothing to compare with, and its error is what the user should read.
    if (asked !== version || shown.b_version === version || (shown.a === null && !queue.busy)) return;
    if (queue.busy) rest_timer = setTimeout(when_rested, FOLLOWS_MS);
    else queue.push(update_b);
  };
  rest_timer = setTimeout(when_rested, FOLLOWS_MS);
}

function show_masks() {
  view.draw();
  const frame = by_id("frame");
  if (view.a) frame.parentElement.style.setProperty("--aspect", String(view.a.width / view.a.height));
  frame.style.setProperty("--wipe", String(view.wipe));
  const comparing = view.mode !== "mask";
  const stale = shown.b_version !== version;
  frame.classList.toggle("failed", shown.a === null);
  by_id("name_a").hidden = by_id("name_b").hidden = !comparing;
  by_id("name_a").textContent = `A  ${a.kind}`;
  by_id("name_b").textContent = `B  ${b.kind}${shown.b === null ? ": to come" : stale ? ": earlier" : ""}`;
  by_id("divider").hidden = by_id("wipe_row").hidden = view.mode !== "wipe";
  by_id("legend").hidden = view.mode !== "difference";
  by_id("b_section").hidden = !comparing;
  show_overlay();
  figures_timer ||= setTimeout(show_figures, FIGURES_MS);
}

function show_overlay() {
  const overlay = by_id("overlay");
  const ratio = devicePixelRatio || 1;
  overlay.width = Math.max(1, Math.round(overlay.clientWidth * ratio));
  overlay.height = Math.max(1, Math.round(overlay.clientHeight * ratio));
  const drawable = source.objects.some((object) => object.quad);
  by_id("casters_label").hidden = !drawable;
  if (drawable && by_id("casters").checked && view.mode !== "difference")
    draw_casters(overlay.getContext("2d"), source.objects, source.receivers.camera, light.position);
}

function show_figures() {
  figures_timer = 0;
  const fresh_b = view.mode !== "mask" && shown.b_version === version;
  const tables = [];
  if (fresh_b && view.a && view.b) {
    if (view.comparable) tables.push(error_table(compare(view.a, view.b), a.kind, b.kind));
  }
  if (shown.a) tables.push(stage_table(view.mode === "mask" ? a.kind : `A  ${a.kind}`, shown.a.stages, shown.a.ms));
  if (fresh_b && shown.b) tables.push(stage_table(`B  ${b.kind}`, shown.b.stages, shown.b.ms));
  by_id("figures").replaceChildren(...tables);
  const warnings = (shown.a?.warnings ?? []).map((text) => Object.assign(document.createElement("li"), { textContent: text }));
  by_id("warnings").replaceChildren(...warnings);
}

const light_panel = new LightPanel(by_id("light"), (next) => {
  const kind_changed = next.kind !== light.kind;
  light = next;
  if (kind_changed) show_techniques();
  update();
});

function show_techniques() {
  const fits = { light: light.kind, suggested: source.suggested };
  technique_panel(by_id("technique_a"), techniques, a, fits, (next) => {
    a = next;
    update();
  });
  technique_panel(by_id("technique_b"), techniques, b, fits, (next) => {
    b = next;
    shown.b = null;
    update();
  });
}

/** Sizes of what the service renders; given images have their own. */
function show_resolutions() {
  const place = by_id("resolutions");
  place.replaceChildren();
  if (!source.renders) return;
  const field = (/** @type {string} */ label, /** @type {"occluders" | "receivers"} */ section, /** @type {number[]} */ sizes) => {
    const options = sizes.map((size) => /** @type {[string, string]} */ ([String(size), `${size} x ${size}`]));
    place.append(choice_field({ label, name: `${section}_resolution`, value: String(source[section].resolution[0]), options }, (size) => {
      source = { ...source, [section]: { ...source[section], resolution: [Number(size), Number(size)] } };
      update();
    }).node);
  };
  field("Occluder map", "occluders", [128, 256, 384, 512, 768, 1024]);
  if (source.receivers.resolution) field("Mask", "receivers", [256, 512, 1024]);
}

/** @param {Source} next */
function use(next) {
  stop_orbit();
  source = next;
  // What suits the new source takes the place of what suited the last.
  const suited = (/** @type {Choice} */ choice) => {
    const own = Object.entries(choice.settings).filter(([key]) => !(key in next.suggested));
    return { kind: choice.kind, settings: { ...Object.fromEntries(own), ...suggested_choice(techniques, choice.kind, next.suggested).settings } };
  };
  a = suited(a);
  b = suited(b);
  light = next.light;
  view.b = shown.b = null;
  by_id("orbit").disabled = next.fixed_light !== "";
  by_id("problem").hidden = true;
  light_panel.show(source, light);
  show_techniques();
  show_resolutions();
  update();
}

const share = new SharePanel(by_id("share"), {
  state: () => ({ scene: scene_json(source, light, a), files: source.files, token: client.token !== "" }),
  download: async (format) => {
    try {
      const reply = await client.mask(scene_json(source, light, a), source.files, format.media_type);
      save(new Blob([reply.buffer], { type: format.media_type }), `mask.${format.extension}`);
      say(`mask.${format.extension} saved`);
    } catch (error) {
      fail(error);
    }
  },
  say,
});

const source_panel = new SourcePanel(by_id("source"), {
  use: (next) => {
    say(`Lighting ${next.title}`);
    use(next);
  },
  measure: (name, file, encoding, fov_deg) => {
    say("Measuring how far the subject is");
    return median_depth(client, name, file, encoding, fov_deg);
  },
  failed: (error) => {
    say("");
    fail(error);
  },
});

// The light on a circle about its target: to see the shadow follow, and to measure how fast.
let orbit_frame = 0;
function stop_orbit() {
  cancelAnimationFrame(orbit_frame);
  orbit_frame = 0;
  by_id("orbit").setAttribute("aria-pressed", "false");
}
function start_orbit() {
  const { position, target } = light;
  const [x, z] = [position[0] - target[0], position[2] - target[2]];
  const begun = performance.now();
  const step = (/** @type {number} */ now) => {
    const turn = 0.35 * Math.sin((now - begun) / 1500);
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    light = { ...light, position: [target[0] + c * x - s * z, position[1], target[2] + s * x + c * z] };
    light_panel.follow(light);
    update();
    orbit_frame = requestAnimationFrame(step);
  };
  orbit_frame = requestAnimationFrame(step);
  by_id("orbit").setAttribute("aria-pressed", "true");
}

function wire() {
  by_id("modes").addEventListener("change", (/** @type {any} */ event) => {
    view.mode = event.target.value;
    show_masks();
    update();
  });
  by_id("tone").addEventListener("change", () => {
    view.tone = by_id("tone").value;
    view.draw();
  });
  by_id("casters").addEventListener("change", show_overlay);
  by_id("orbit").addEventListener("click", () => (orbit_frame ? stop_orbit() : start_orbit()));
  const wipe_to = (/** @type {number} */ share_of_width) => {
    view.wipe = Math.min(Math.max(share_of_width, 0), 1);
    by_id("wipe").value = String(100 * view.wipe);
    by_id("frame").style.setProperty("--wipe", String(view.wipe));
    view.draw();
  };
  by_id("wipe").addEventListener("input", () => wipe_to(by_id("wipe").valueAsNumber / 100));
  const frame = by_id("frame");
  const drag = (/** @type {PointerEvent} */ event) => {
    if (view.mode !== "wipe" || (event.type === "pointermove" && !frame.hasPointerCapture(event.pointerId))) return;
    frame.setPointerCapture(event.pointerId);
    const box = frame.getBoundingClientRect();
    wipe_to((event.clientX - box.left) / box.width);
  };
  frame.addEventListener("pointerdown", drag);
  frame.addEventListener("pointermove", drag);
  new ResizeObserver(show_overlay).observe(frame);

  addEventListener("dragover", (event) => {
    event.preventDefault();
    frame.classList.add("dropping");
  });
  addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) frame.classList.remove("dropping");
  });
  addEventListener("drop", (event) => {
    event.preventDefault();
    frame.classList.remove("dropping");
    source_panel.drop([...(event.dataTransfer?.files ?? [])]);
  });
  by_id("token_form").addEventListener("submit", (/** @type {Event} */ event) => {
    event.preventDefault();
    client.token = by_id("token").value;
    by_id("token_form").hidden = true;
    begin();
  });
}

/** A first choice that the service knows. @param {string} wanted @param {number} otherwise index in its list @returns {Choice} */
function known(wanted, otherwise) {
  const found = techniques.some((one) => one.kind === wanted) ? wanted : techniques[Math.min(otherwise, techniques.length - 1)].kind;
  return { kind: found, settings: {} };
}

async function begin() {
  try {
    techniques = await client.techniques();
    const { version: release, device } = await client.device();
    by_id("device").textContent = `${device}, version ${release}`;
    by_id("problem").hidden = true;
    a = known(FIRST.a, 0);
    b = known(FIRST.b, 1);
    use(source);
  } catch (error) {
    fail(error);
  }
}

wire();
begin();
