// @ts-check
// The page: one state, a queue of requests that follows it and one for slow masks, and the panels that change the state and show the masks.
import { draw_casters } from "./casters.js";
import { Client, ServiceError } from "./client.js";
import { choice_field } from "./fields.js";
import { error_table, stage_table } from "./figures.js";
import { LightPanel } from "./light_panel.js";
import { compare } from "./metrics.js";
import { decode_pfm } from "./pfm.js";
import { Orbit } from "./orbit.js";
import { choose_picture, show_picture_choice } from "./picture_choice.js";
import { median_depth } from "./probe.js";
import { LatestQueue } from "./queue.js";
import { RateMeter } from "./rate.js";
import { courtyard_source, scene_json } from "./scene.js";
import { save, SharePanel } from "./share_panel.js";
import { SourcePanel } from "./source_panel.js";
import { draft_of, suggested_choice, technique_panel } from "./technique_panel.js";
import { View } from "./view.js";
import { wire_wipe } from "./wipe.js";

/** @typedef {import("./scene.js").Source} Source */
/** @typedef {import("./technique_panel.js").Choice} Choice */
/** @typedef {import("./client.js").MaskReply} MaskReply */

const PFM = "image/x-portable-floatmap";
/** What the page opens with, where the service knows it; else the service's first. */
const FIRST = { a: "soft_shadow_map", b: "ray_traced" };
/** The second mask follows the light at once when it takes less than this; else, as a mask that was drafted, when the light has rested that
 * long. */
const FOLLOWS_MS = 150;
/** Tables follow a moving light this often: nobody reads them faster. */
const FIGURES_MS = 250;
/** How long a message stays. */
const SAID_MS = 4000;

const by_id = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

const client = new Client();
const queue = new LatestQueue();
/** What takes long, while a draft or a first mask is shown: a light that moves again does not wait for it. */
const slow_queue = new LatestQueue();
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
/** `draft` is the technique that stands in for A's. @type {{a: MaskReply | null, a_version: number, draft: Choice | null, b: MaskReply | null, b_version: number}} */
const shown = { a: null, a_version: -1, draft: null, b: null, b_version: -1 };
/** How long the last draft and the last mask in full took, from asking for them to the last byte. */
const taken_ms = { draft: 0, full: Infinity };
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

/** The technique that may stand in for A's while the light moves; null: A's own does. */
const draft_choice = () => (by_id("draft").checked ? draft_of(techniques, a, source, light.kind) : null);
/** That technique, unless A's own is as quick here. */
const draft_now = () => (taken_ms.full > taken_ms.draft ? draft_choice() : null);

/** @param {Choice | null} draft */
async function update_a(draft) {
  const asked = version;
  const choice = draft ?? a;
  try {
    const reply = await ask(choice);
    // The light has gone on, and its draft is there already.
    if (shown.a_version > asked) return;
    taken_ms[draft ? "draft" : "full"] = reply.ms;
    view.a = decode_pfm(reply.buffer);
    Object.assign(shown, { a: reply, a_version: asked, draft });
    by_id("problem").hidden = true;
    by_id("rate").textContent = rate.tick(performance.now());
    // Announced to scripts and tests: this version of the state is on the screen, as a draft or in full.
    by_id("mask").dataset.version = String(asked);
    by_id("mask").dataset.technique = choice.kind;
  } catch (error) {
    if (shown.a_version > asked) return;
    if (waits(error, () => update(draft !== null))) return;
    // A draft stays in sight: it is right for what it is.
    const drafted = !draft && shown.draft !== null;
    Object.assign(shown, drafted ? { a_version: asked } : { a: null, a_version: asked, draft });
    fail(error, drafted ? `${choice.kind}: ` : "");
  }
  show_masks();
  if (!draft && view.mode !== "mask" && shown.b && shown.b.ms < FOLLOWS_MS && asked === version) await update_b();
}

async function update_b() {
  const asked = version;
  try {
    const reply = await ask(b);
    if (shown.b_version > asked) return;
    view.b = decode_pfm(reply.buffer);
    shown.b = reply;
    shown.b_version = asked;
    by_id("mask").dataset.versionB = String(asked);
  } catch (error) {
    if (waits(error, () => update())) return;
    view.b = null;
    shown.b = null;
    fail(error, `${b.kind}: `);
  }
  show_masks();
}

/** What is missing when the light rests: A in full, and B. @param {number} asked the version that rested */
async function complete(asked) {
  if (asked !== version) return;
  if (shown.draft || shown.a_version !== version) await update_a(null);
  // Without a first mask there is nothing to compare with, and its error is what the user should read.
  if (view.mode !== "mask" && asked === version && shown.b_version !== version && shown.a) await update_b();
}

/** Asks for masks of the state as it is now. @param {boolean} [light_moved] whether the light alone has changed, or all is new: a draft does first */
function update(light_moved = false) {
  version++;
  const draft = draft_now();
  if (draft && !light_moved) slow_queue.push(() => update_a(null));
  else queue.push(() => update_a(draft));
  share.refresh();
  clearTimeout(rest_timer);
  if (view.mode === "mask" && !draft) return;
  const asked = version;
  const when_rested = () => {
    if (asked !== version) return;
    if (queue.busy) rest_timer = setTimeout(when_rested, FOLLOWS_MS);
    else slow_queue.push(() => complete(asked));
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
  const drafted = shown.draft !== null;
  by_id("name_b").hidden = !comparing;
  by_id("name_a").hidden = !comparing && draft_choice() === null && !drafted;
  by_id("name_a").textContent = `${comparing ? "A  " : ""}${(shown.draft ?? a).kind}${drafted ? `: draft; ${a.kind} when the light rests` : ""}`;
  by_id("name_b").textContent = `B  ${b.kind}${shown.b === null ? ": to come" : stale ? ": earlier" : ""}`;
  by_id("divider").hidden = by_id("wipe_row").hidden = view.mode !== "wipe";
  by_id("legend").hidden = view.mode !== "difference";
  show_picture_choice(view);
  if (source.picture) share.refresh();
  by_id("b_section").hidden = !comparing;
  show_overlay();
  figures_timer ||= setTimeout(show_figures, FIGURES_MS);
}

/** @param {import("./picture.js").Picture | null} picture */
function use_picture(picture) {
  source = { ...source, picture };
  choose_picture(view, picture);
  share.refresh();
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
  const fresh_b = view.mode !== "mask" && shown.b_version === version && !shown.draft;
  const kind = shown.draft ? `${shown.draft.kind}, draft` : a.kind;
  const tables = [];
  if (fresh_b && view.a && view.b) {
    if (view.comparable) tables.push(error_table(compare(view.a, view.b), a.kind, b.kind));
  }
  if (shown.a) tables.push(stage_table(view.mode === "mask" ? kind : `A  ${kind}`, shown.a.stages, shown.a.ms));
  if (fresh_b && shown.b) tables.push(stage_table(`B  ${b.kind}`, shown.b.stages, shown.b.ms));
  by_id("figures").replaceChildren(...tables);
  const warnings = (shown.a?.warnings ?? []).map((text) => Object.assign(document.createElement("li"), { textContent: text }));
  by_id("warnings").replaceChildren(...warnings);
}

const light_panel = new LightPanel(by_id("light"), (next) => {
  const kind_changed = next.kind !== light.kind;
  light = next;
  if (kind_changed) show_techniques();
  update(true);
});

function show_techniques() {
  const fits = { light: light.kind, suggested: source.suggested };
  show_draft_choice();
  technique_panel(by_id("technique_a"), techniques, a, fits, (next) => {
    a = next;
    show_draft_choice();
    update();
  });
  technique_panel(by_id("technique_b"), techniques, b, fits, (next) => {
    b = next;
    shown.b = null;
    update();
  });
}

/** The switch of drafts, where there is one for A's technique. How long the two take is new. */
function show_draft_choice() {
  Object.assign(taken_ms, { draft: 0, full: Infinity });
  const draft = draft_of(techniques, a, source, light.kind);
  by_id("draft_row").hidden = draft === null;
  if (draft) by_id("draft_help").textContent = `${draft.kind} while the light moves, ${a.kind} when it rests, unless that is as quick.`;
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
  orbit.stop();
  const other = next.kind !== source.kind;
  source = next;
  // Another kind of source takes the technique that is its own.
  if (other) a = known(next.technique || FIRST.a, 0);
  // What suits the new source takes the place of what suited the last.
  const suited = (/** @type {Choice} */ choice) => {
    const own = Object.entries(choice.settings).filter(([key]) => !(key in next.suggested));
    return { kind: choice.kind, settings: { ...Object.fromEntries(own), ...suggested_choice(techniques, choice.kind, next.suggested).settings } };
  };
  a = suited(a);
  b = suited(b);
  light = next.light;
  view.b = shown.b = null;
  // Masks of the last source that are still on their way come too late.
  shown.a_version = version + 1;
  shown.b_version = version;
  use_picture(next.picture);
  by_id("orbit").disabled = next.fixed_light !== "";
  by_id("problem").hidden = true;
  light_panel.show(source, light);
  show_techniques();
  show_resolutions();
  update(true);
}

const share = new SharePanel(by_id("share"), {
  state: () => ({
    scene: scene_json(source, light, a), files: source.files, token: client.token !== "",
    bounds: techniques.some((one) => one.kind === a.kind && one.bounds),
    picture: view.shows_picture && view.picture ? { name: view.picture.name, whole: view.picture.size === `${view.a?.width} x ${view.a?.height}` } : null,
  }),
  download: async ({ image, media_type, extension }) => {
    try {
      say(`Computing ${image}.${extension}`);
      const reply = await client.mask(scene_json(source, light, a), source.files, media_type, image);
      save(new Blob([reply.buffer], { type: media_type }), `${image}.${extension}`);
      say(`${image}.${extension} saved`);
    } catch (error) {
      say("");
      fail(error);
    }
  },
  download_picture: () => by_id("mask").toBlob((/** @type {Blob} */ blob) => {
    save(blob, "preview.png");
    say("preview.png saved");
  }),
  say,
});

const source_panel = new SourcePanel(by_id("source"), {
  use: (next) => {
    say(`Lighting ${next.title}`);
    use(next);
  },
  use_picture: (picture) => {
    use_picture(picture);
    show_masks();
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

// To see the shadow follow, and to measure how fast.
const orbit = new Orbit(by_id("orbit"), {
  light: () => light,
  moved: (next) => {
    light = next;
    light_panel.follow(light);
    update(true);
  },
});

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
  by_id("shows").addEventListener("change", (/** @type {any} */ event) => {
    view.shows = event.target.value;
    show_masks();
    share.refresh();
  });
  by_id("draft").addEventListener("change", () => update());
  wire_wipe(view, by_id("frame"), by_id("wipe"));
  const frame = by_id("frame");
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
