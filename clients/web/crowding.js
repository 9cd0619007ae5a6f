// @ts-check
// A light among casters. For each receiver, soft_shadow_map looks at the texels that can hide a part of the light. Where a caster is nearer to
// the light's centre than the light is large, these are most of the map: a mask that takes 50 ms elsewhere takes a minute. A coarse map does then;
// what is so near throws no sharp shadow.
import { add, dot, length, scale, subtract } from "./vector.js";

/** @typedef {import("./vector.js").Vec3} Vec3 */
/** @typedef {import("./light.js").Light} Light */
/** @typedef {import("./technique_panel.js").Choice} Choice */
/** @typedef {import("./client.js").Json} Json */

const CROWDED = "soft_shadow_map";
/** Side of the occluder map for it: 64 times fewer texels than the 384 x 384 of the courtyard. */
export const CROWDED_MAP = 48;

/** @param {Vec3} point @param {Json} quad */
export function distance_to(point, { center, half_u, half_v }) {
  const along = subtract(point, center);
  const share = (/** @type {Vec3} */ half) => Math.min(Math.max(dot(along, half) / dot(half, half), -1), 1);
  const nearest = add(scale(half_u, share(half_u)), scale(half_v, share(half_v)));
  return length(subtract(along, nearest));
}

/** Whether a caster is nearer to the light's centre than the light's own corners. @param {Light} light @param {Json[]} objects */
export function is_crowded(light, objects) {
  if (light.kind !== "rectangle") return false;
  const reach = Math.hypot(light.width, light.length) / 2;
  return objects.some(({ quad, casts }) => quad && casts !== false && distance_to(light.position, quad) < reach);
}

/** The choice, with a coarse map where the light is crowded. @param {Choice} choice @param {Light} light @param {Json[]} objects @returns {Choice} */
export function eased(choice, light, objects) {
  const { resolution = 0 } = choice.settings;
  if (choice.kind !== CROWDED || (resolution > 0 && resolution <= CROWDED_MAP) || !is_crowded(light, objects)) return choice;
  return { kind: choice.kind, settings: { ...choice.settings, resolution: CROWDED_MAP } };
}
