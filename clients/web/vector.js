// @ts-check
// Vectors of three numbers, as arrays.

/** @typedef {[number, number, number]} Vec3 */

/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];

/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/** @param {Vec3} a @param {number} s @returns {Vec3} */
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];

/** @param {Vec3} a @param {Vec3} b */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @param {Vec3} a @param {Vec3} b @returns {Vec3} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** @param {Vec3} a */
export const length = (a) => Math.sqrt(dot(a, a));

/** Of length 1. A zero vector has no direction and is an error.
 * @param {Vec3} a @returns {Vec3} */
export function normalized(a) {
  const size = length(a);
  if (!(size > 0)) throw new Error("a vector of length 0 has no direction");
  return scale(a, 1 / size);
}

/** For people: six decimals at most, and no negative zero.
 * @param {Vec3} a @returns {Vec3} */
export const tidy = (a) => /** @type {Vec3} */ (a.map((value) => Math.round(value * 1e6) / 1e6 + 0));
