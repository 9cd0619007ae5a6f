// @ts-check
// The scene that the page starts with: a pergola, an arch and some boxes in a courtyard, made of parallelograms.
import { add, cross, scale, tidy } from "./vector.js";

/** @typedef {import("./vector.js").Vec3} Vec3 */
/** @typedef {{quad: {center: Vec3, half_u: Vec3, half_v: Vec3}, casts?: boolean, receives?: boolean}} Quad */

/** The six sides of a box, fronts outward. `x` and `y` are half-edges at a right angle, `depth` is half the third edge.
 * @param {Vec3} center @param {Vec3} x @param {Vec3} y @param {number} depth @returns {Quad[]} */
function box(center, x, y, depth) {
  const normal = cross(x, y);
  const z = scale(normal, depth / Math.hypot(...normal));
  /** @param {Vec3} out @param {Vec3} half_u @param {Vec3} half_v @returns {Quad} */
  const side = (out, half_u, half_v) => ({ quad: { center: tidy(add(center, out)), half_u: tidy(half_u), half_v: tidy(half_v) }, receives: false });
  return [
    side(z, x, y), side(scale(z, -1), y, x),
    side(x, y, z), side(scale(x, -1), z, y),
    side(y, z, x), side(scale(y, -1), x, z),
  ];
}

/** A box that stands upright, turned about Y.
 * @param {Vec3} center @param {Vec3} half @param {number} [turn_deg] */
function upright(center, half, turn_deg = 0) {
  const turn = (turn_deg * Math.PI) / 180;
  return box(center, [half[0] * Math.cos(turn), 0, -half[0] * Math.sin(turn)], [0, half[1], 0], half[2]);
}

/** Slats on two beams on four posts.
 * @param {Vec3} middle @param {number} height */
function pergola(middle, height) {
  const [x, y, z] = middle;
  const parts = [];
  for (const dx of [-1.5, 1.5])
    for (const dz of [-1, 1]) parts.push(...upright([x + dx, y + height / 2, z + dz], [0.09, height / 2, 0.09]));
  for (const dz of [-1, 1]) parts.push(...upright([x, y + height + 0.1, z + dz], [1.8, 0.1, 0.06]));
  for (let i = 0; i < 9; i++) parts.push(...upright([x - 1.6 + 0.4 * i, y + height + 0.3, z], [0.05, 0.1, 1.4]));
  return parts;
}

/** Two pillars and a half circle of stones.
 * @param {Vec3} middle @param {number} radius @param {number} spring height of the pillars */
function arch(middle, radius, spring) {
  const [x, y, z] = middle;
  const stones = 9;
  const parts = [];
  for (const side of [-1, 1]) parts.push(...upright([x + side * radius, y + spring / 2, z], [0.17, spring / 2, 0.2]));
  for (let i = 0; i < stones; i++) {
    const angle = (Math.PI * (i + 0.5)) / stones;
    const along = /** @type {Vec3} */ ([-Math.sin(angle), Math.cos(angle), 0]);
    const out = /** @type {Vec3} */ ([Math.cos(angle), Math.sin(angle), 0]);
    const center = add([x, y + spring, z], scale(out, radius));
    parts.push(...box(center, scale(out, 0.17), scale(along, (Math.PI * radius) / stones / 2 + 0.01), 0.2));
  }
  return parts;
}

/** A quad that is only shaded.
 * @param {Vec3} center @param {Vec3} half_u @param {Vec3} half_v @returns {Quad} */
const ground = (center, half_u, half_v) => ({ quad: { center, half_u, half_v }, casts: false });

/** @returns {Quad[]} */
export function courtyard() {
  return [
    ground([0, 0, 0.5], [6, 0, 0], [0, 0, -4]),
    ground([0, 2.5, -3.5], [6, 0, 0], [0, 2.5, 0]),
    ...pergola([-1.5, 0, -1.2], 2.1),
    ...arch([2.15, 0, -1.5], 0.75, 1.25),
    ...upright([1.0, 0.35, 1.6], [0.35, 0.35, 0.35], 30),
    ...upright([1.95, 0.2, 1.3], [0.2, 0.2, 0.2], 12),
    ...upright([-0.6, 0.9, 2.1], [0.05, 0.9, 0.05], 20),
    ...upright([-1.15, 0.65, 1.95], [0.05, 0.65, 0.05], 50),
    ...upright([-1.65, 0.4, 2.1], [0.05, 0.4, 0.05], 35),
  ];
}

/** The view of it. */
export const courtyard_view = { kind: "pinhole", eye: [4.2, 5.4, 9.4], target: [0.05, 0.75, -0.6], up: [0, 1, 0], vertical_fov_deg: 35 };
