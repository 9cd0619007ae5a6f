// @ts-check
// The light as the page moves it, and as the scene file says it.
import { cross, length, normalized, scale, subtract } from "./vector.js";

/** @typedef {import("./vector.js").Vec3} Vec3 */
/** `position` to `target` is where it shines; a directional light has only that direction. Sizes are whole, not halves.
 * @typedef {{kind: string, position: Vec3, target: Vec3, width: number, length: number, radius: number, angular_diameter_deg: number}} Light */

/** Kinds and the sizes that each has. @type {Record<string, {label: string, sizes: (keyof Light)[]}>} */
export const LIGHT_KINDS = {
  rectangle: { label: "Rectangle", sizes: ["width", "length"] },
  sphere: { label: "Sphere", sizes: ["radius"] },
  directional: { label: "Directional (sun)", sizes: ["angular_diameter_deg"] },
  point: { label: "Point", sizes: [] },
};

/** Nine digits: more than a float32 has, so that edges stay at a right angle; what is rounding beside the largest becomes 0.
 * @param {Vec3} a @returns {Vec3} */
function written(a) {
  const rounding = Math.max(...a.map(Math.abs)) * 1e-12;
  return /** @type {Vec3} */ (a.map((value) => (Math.abs(value) <= rounding ? 0 : Number(value.toPrecision(9)))));
}

/** The axes of a light that shines along `direction`: u to the right and v up, seen along it.
 * @param {Vec3} direction @returns {{u: Vec3, v: Vec3}} */
export function axes_of(direction) {
  // As the scene file: within 8 degrees of the Y axis, up is -Z.
  /** @type {Vec3} */
  const up = Math.abs(direction[1]) > Math.cos((8 * Math.PI) / 180) ? [0, 0, -1] : [0, 1, 0];
  const u = normalized(cross(direction, up));
  return { u, v: cross(u, direction) };
}

/** Where it shines; down, when it stands on its target.
 * @param {Light} light @returns {Vec3} */
export function direction_of(light) {
  const along = subtract(light.target, light.position);
  return length(along) > 0 ? normalized(along) : [0, -1, 0];
}

/** The `light` section of a scene. @param {Light} light */
export function light_json(light) {
  const direction = direction_of(light);
  const center = written(light.position);
  switch (light.kind) {
    case "rectangle": {
      const { u, v } = axes_of(direction);
      return { kind: "rectangle", center, half_u: written(scale(u, light.width / 2)), half_v: written(scale(v, light.length / 2)) };
    }
    case "sphere":
      return { kind: "sphere", center, radius: light.radius, direction: written(direction) };
    case "point":
      return { kind: "point", center, direction: written(direction) };
    case "directional":
      return { kind: "directional", direction: written(direction), angular_diameter_deg: light.angular_diameter_deg };
    default:
      throw new Error(`unknown kind of light "${light.kind}"`);
  }
}
