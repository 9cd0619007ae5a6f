// @ts-check
// The page: one state, the panels that change it, and the masks that follow it.
import { Busy } from "./busy.js";
import { Client, ServiceError } from "./client.js";
import { eased } from "./crowding.js";
import { depth_view } from "./depth_view.js";
import { choice_field } from "./fields.js";
import { Follower } from "./follower.js";
import { LightPanel } from "./light_panel.js";
import { Orbit } from "./orbit.js";
import { Outage } from "./outage.js";
import { choose_picture } from "./picture_choice.js";
import { RateMeter } from "./rate.js";
import { courtyard_source, scene_json } from "./scene.js";
import { save, SharePanel } from "./share_panel.js";
import { SourcePanel } from "./source_panel.js";
import { Stage } from "./stage.js";
import { draft_of, stand_in_of, suggested_choice, technique_panel } from "./technique_panel.js";
import { View } from "./view.js";
import { wire_wipe } from "./wipe.js";

/** @typedef {import("./scene.js").Source} Source */
/** @typedef {import("./technique_panel.js").Choice} Choice */

const PFM = "image/x-portable-floatmap";
/** What the page opens with, where the service knows it; else the service's first. */
const FIRST = { a: "soft_shadow_map", b: "ray_traced" };
/** How long a message stays. */
const SAID_MS = 4000;

const by_id = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

const client = new Client();
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
let said_timer = 0;
/** What the problem that is shown is of. @type {"start" | "mask" | "scene" | "download"} */
let problem_of = "start";

/** @param {string} text */
function say(text) {
  by_id("said").textContent = text;
  clearTimeout(said_timer);
  said_timer = setTimeout(() => (by_id("said").textContent = ""), SAID_MS);
}

/** @param {typeof problem_of} of @param {unknown} error @param {string} [whose] @param {boolean} [kept] the last mask stays in sight: no reason for alarm */
function fail(of, error, whose = "", kept = false) {
  problem_of = of;
  if (error instanceof ServiceError && error.status === 401) {
    by_id("token_form").hidden = false;
    by_id("token").focus();
  }
  const box = by_id("problem");
  box.textContent = `${kept && !whose ? "No mask here: " : whose}${error instanceof Error ? error.message : String(error)}`;
  box.classList.toggle("calm", kept);
  box.setAttribute("role", kept ? "status" : "alert");
  box.hidden = false;
}

/** It went well: a problem that was of this is none any more. A mask that comes says nothing of a file that was refused.
 * @param {typeof problem_of} of */
function went_well(of) {
  if (problem_of === of) by_id("problem").hidden = true;
}

const outage = new Outage((text) => {
  by_id("outage").textContent = text;
  by_id("outage").hidden = text === "";
});

/** The technique that may stand in for A's while the light moves; null: A's own does. */
const draft_choice = () => (by_id("draft").checked ? draft_of(techniques, a, source, light.kind) : null);

const state = () => ({
  source, light: light.kind, comparing: view.mode !== "mask",
  a: eased(a, light, source.objects), b: eased(b, light, source.objects), eased: eased(a, light, source.objects) !== a,
  draft: draft_choice(), stand_in: stand_in_of(techniques, a, source, light.kind),
});

const busy = new Busy(by_id("busy"));

/** What is asked for once, and again where the service does not answer. @template T @param {string} name @param {() => Promise<T>} ask
 * @returns {Promise<T>} */
async function steadily(name, ask) {
  const end = busy.begin(name);
  try {
    const answer = await ask();
    outage.over();
    return answer;
  } catch (error) {
    if (!Outage.is(error)) throw error;
    await outage.wait(error);
  } finally {
    end();
  }
  return steadily(name, ask);
}

const follower = new Follower(view, outage, busy, {
  state,
  ask: (choice, draft) => {
    const lit = draft && source.small ? { ...source, ...source.small } : source;
    return client.mask(scene_json(lit, light, choice), lit.files, PFM);
  },
  show: () => {
    stage.show();
    // The lines to copy depend on the size of the mask that it lies under.
    if (source.picture) share.refresh();
  },
  came: (whose, choice) => {
    if (whose === "b") {
      by_id("mask").dataset.versionB = String(follower.shown.b_version);
      return;
    }
    went_well("mask");
    by_id("rate").textContent = rate.tick(performance.now());
    // Announced to scripts and tests: this version of the state is on the screen, as a draft or in full.
    by_id("mask").dataset.version = String(follower.shown.a_version);
    by_id("mask").dataset.technique = choice.kind;
  },
  failed: (error, whose, kept) => {
    by_id("mask").dataset.refused = String(follower.shown.a_version);
    fail("mask", error, whose, kept);
  },
});
const stage = new Stage(view, follower, { state, light: () => light });

/** @param {boolean} [light_moved] */
function update(light_moved = false) {
  follower.update(light_moved);
  by_id("mask").dataset.asked = String(follower.version);
  stage.show_names();
  stage.show_overlay();
  share.refresh();
}

/** @param {import("./picture.js").Picture | null} picture */
function use_picture(picture) {
  source = { ...source, picture };
  choose_picture(view, picture);
  share.refresh();
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
    update();
  });
}

/** The switch of drafts, where there is one for A's technique. How long the two take is new. */
function show_draft_choice() {
  follower.forget_times();
  const draft = draft_of(techniques, a, source, light.kind);
  by_id("draft_row").hidden = draft === null;
  if (!draft) return;
  const size = source.small ? ` at ${source.small.size.join(" x ")}` : "";
  by_id("draft_help").textContent = `${draft.kind}${size} while the light moves, ${a.kind} when it rests, unless that is as quick.`;
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
  const other = next.kind !== source.kind, last = source;
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
  if (a.kind === next.technique) {
    const chosen = Object.entries(a.settings).filter(([key, value]) => last.settings[key] !== value);
    a = { kind: a.kind, settings: { ...next.settings, ...Object.fromEntries(chosen) } };
  }
  light = next.light;
  follower.forget_masks();
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
      went_well("download");
    } catch (error) {
      say("");
      fail("download", error);
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
    went_well("scene");
    stage.show();
  },
  look: (name, file, encoding, fov_deg) => steadily(`reading ${name}`, () => depth_view(client, name, file, encoding, fov_deg)),
  failed: (error) => {
    say("");
    fail("scene", error);
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
    stage.show();
    stage.show_overlay();
    update();
  });
  by_id("tone").addEventListener("change", () => {
    view.tone = by_id("tone").value;
    view.draw();
  });
  by_id("shows").addEventListener("change", (/** @type {any} */ event) => {
    view.shows = event.target.value;
    stage.show();
    share.refresh();
  });
  by_id("draft").addEventListener("change", () => update());
  wire_wipe(view, by_id("frame"), by_id("wipe"));
  const frame = by_id("frame");

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
    techniques = await steadily("starting", () => client.techniques());
    const { version: release, device } = await steadily("starting", () => client.device());
    by_id("device").textContent = `${device}, version ${release}`;
    by_id("problem").hidden = true;
    a = known(FIRST.a, 0);
    b = known(FIRST.b, 1);
    use(source);
  } catch (error) {
    fail("start", error);
  }
}

wire();
begin();
