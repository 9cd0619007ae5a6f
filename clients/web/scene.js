// @ts-check
// What is lit: the bundled courtyard, one camera's depth, or depth seen from a light. Each becomes a scene file.
import { courtyard, courtyard_view } from "./courtyard.js";
import { CASTER_SIDE } from "./depth_view.js";
import { light_json } from "./light.js";

/** @typedef {import("./vector.js").Vec3} Vec3 */
/** @typedef {import("./light.js").Light} Light */
/** @typedef {import("./client.js").Json} Json */
/** @typedef {import("./client.js").Files} Files */
/** The part of space that the light is moved in: a square of half side `reach` about `middle`, seen from above, and heights.
 * @typedef {{middle: Vec3, reach: number, low: number, high: number}} Room */
/** What stands in while the light moves and the whole is too slow: the same at fewer pixels.
 * @typedef {{size: [number, number], objects: Json[], occluders: Json, receivers: Json, files: Files}} Small */
/** `fixed_light` says why only the light's size can change; empty when the light moves freely. `lights` are the kinds that the source allows,
 * `suggested` the settings that suit it, for techniques that have such a key. `technique` is the kind that suits it ("": the page's first), and
 * `settings` those of that technique;
 * `drafts` are kinds that may stand in for a traced one while the light moves, `stand_ins` for one that turns out to be slow. `picture` is what the depth belongs to.
 * @typedef {{kind: string, title: string, objects: Json[], occluders: Json, receivers: Json, files: Files, room: Room, light: Light,
 *            fixed_light: string, lights: string[], renders: boolean, suggested: Json, technique: string, settings: Json, drafts: string[], stand_ins: string[],
 *            picture: import("./picture.js").Picture | null, small: Small | null}} Source */

const EVERY_LIGHT = ["rectangle", "sphere", "directional", "point"];

/** @returns {Source} */
export function courtyard_source() {
  const objects = courtyard(), files = new Map();
  return {
    kind: "courtyard", title: "Courtyard", objects, files,
    occluders: { resolution: [384, 384] }, receivers: { camera: courtyard_view, resolution: [512, 512] },
    room: { middle: [0, 0, 1], reach: 7, low: 1, high: 11 },
    light: {
      kind: "rectangle", position: [-3.4, 6.2, 4.8], target: [0, 0.6, -0.6],
      width: 0.9, length: 0.9, radius: 0.5, angular_diameter_deg: 4,
    },
    // Sums of patches: the union takes half a second here, and the light is to be followed.
    fixed_light: "", lights: EVERY_LIGHT, renders: true, suggested: { sides: "both", visibility: "sum" },
    technique: "", settings: {}, drafts: [], stand_ins: ["soft_shadow_volume", "shadow_map"], picture: null,
    small: { size: [256, 256], objects, occluders: { resolution: [192, 192] }, receivers: { camera: courtyard_view, resolution: [256, 256] }, files },
  };
}

/** One camera's depth image, in the camera's own space: at the origin, looking along -Z. The light begins beside the camera.
 * @param {{name: string, file: Blob, encoding: Json, vertical_fov_deg: number, distance: number, picture?: import("./picture.js").Picture | null,
 *          view?: import("./depth_view.js").DepthView | null}} given
 *   `distance`: how far the middle of the picture is, in scene units; `view`: its depth at few pixels
 * @returns {Source} */
export function camera_source({ name, file, encoding, vertical_fov_deg, distance, picture = null, view = null }) {
  const camera = { kind: "pinhole", eye: [0, 0, 0], target: [0, 0, -distance], up: [0, 1, 0], vertical_fov_deg };
  const coded = encoding.kind === "planar" && Object.keys(encoding).length === 1 ? {} : { encoding };
  return {
    kind: "camera", title: name, files: new Map([[name, file]]),
    objects: [{ depth: name, camera, ...coded }],
    // Fine enough for drafts, and quickly rendered: most of their time. Rays through the image need no map.
    occluders: { resolution: [128, 128] }, receivers: { camera, depth: name, ...coded },
    room: { middle: [0, 0, -distance], reach: 1.6 * distance, low: -1.5 * distance, high: 2 * distance },
    light: {
      kind: "rectangle", position: [-0.7 * distance, 0.8 * distance, -0.5 * distance], target: [0, 0, -distance],
      width: 0.15 * distance, length: 0.15 * distance, radius: 0.08 * distance, angular_diameter_deg: 4,
    },
    // A camera's depth has no back sides.
    fixed_light: "", lights: EVERY_LIGHT, renders: true, suggested: { sides: "front" },
    // What the service takes by itself for depth alone; it is slow, and these are quick.
    technique: "depth_trace", settings: view ? samples_for(view.size) : {}, drafts: ["soft_shadow_map", "shadow_map"], stand_ins: [], picture,
    small: view && Math.max(...view.size) > CASTER_SIDE ? small_of(view, camera) : null,
  };
}

/** The rays that a service allows for a mask, unless it is told otherwise; and the samples that depth_trace takes by itself. */
const RAYS = 2 ** 26, SAMPLES = 64;

/** As many samples of a large image as a service allows. @param {[number, number]} size @returns {Json} */
function samples_for([width, height]) {
  const samples = Math.max(1, Math.floor(RAYS / (width * height)));
  return samples < SAMPLES ? { samples } : {};
}

/** Side of the occluder map of a draft: rendering it is most of its time. */
const DRAFT_MAP = 96;

/** @param {import("./depth_view.js").DepthView} view @param {Json} camera @returns {Small} */
function small_of({ file, caster, width, height }, camera) {
  const files = new Map([["receivers.pfm", file], ["caster.pfm", caster]]);
  const objects = [{ depth: "caster.pfm", camera }];
  return { size: [width, height], objects, occluders: { resolution: [DRAFT_MAP, DRAFT_MAP] }, receivers: { camera, depth: "receivers.pfm" }, files };
}

/** Depth seen from a light's centre, in the light's own space: at the origin, shining along -Z.
 * @param {{front: [string, Blob], back?: [string, Blob], receiver: [string, Blob], encoding: Json, tan_half_fov: number, distance: number}} given
 * @returns {Source} */
export function light_view_source({ front, back, receiver, encoding, tan_half_fov, distance }) {
  const camera = { kind: "light", tan_half_fov };
  const depth = back ? { front: front[0], back: back[0] } : { front: front[0] };
  return {
    kind: "light_view", title: front[0], files: new Map([front, receiver, ...(back ? [back] : [])]), objects: [],
    occluders: { camera, depth, encoding }, receivers: { camera, depth: receiver[0], encoding },
    room: { middle: [0, 0, -distance], reach: distance, low: -distance, high: distance },
    light: {
      kind: "rectangle", position: [0, 0, 0], target: [0, 0, -distance],
      width: 0.15 * distance, length: 0.15 * distance, radius: 0, angular_diameter_deg: 0,
    },
    fixed_light: "Only the size can change: these maps were seen from this light's centre along its axis. Another place would need other maps.",
    lights: ["rectangle", "point"], renders: false, suggested: { sides: back ? "both" : "front" },
    technique: "", settings: {}, drafts: [], stand_ins: [], picture: null, small: null,
  };
}

/** @param {Source} source @param {Light} light @param {{kind: string, settings: Json}} technique @returns {Json} */
export function scene_json(source, light, technique) {
  return {
    penumbra: 1,
    light: light_json(light),
    ...(source.objects.length > 0 ? { objects: source.objects } : {}),
    occluders: source.occluders,
    receivers: source.receivers,
    technique: { kind: technique.kind, ...technique.settings },
  };
}
