// @ts-check
// A drawing of what casts the shadow, over the mask: the mask itself shows receivers only.
import { cross, dot, length, normalized, subtract } from "./vector.js";

/** @typedef {import("./vector.js").Vec3} Vec3 */
/** @typedef {import("./client.js").Json} Json */

/** A pinhole camera's axes, and the tangent of half its field of view. @param {Json} camera */
export function camera_axes(camera) {
  const forward = normalized(subtract(camera.target, camera.eye));
  const right = normalized(cross(forward, camera.up));
  return { forward, right, up: cross(right, forward), tangent: Math.tan((camera.vertical_fov_deg * Math.PI) / 360) };
}

/** Image coordinates, 0 to 1 from the upper left corner, of points before a pinhole camera.
 * @param {Json} camera @param {number} aspect width over height */
export function projection(camera, aspect) {
  const { forward, right, up, tangent } = camera_axes(camera);
  return (/** @type {Vec3} */ point) => {
    const along = subtract(point, camera.eye);
    const depth = dot(along, forward);
    return { x: 0.5 + dot(along, right) / (depth * tangent * aspect) / 2, y: 0.5 - dot(along, up) / (depth * tangent) / 2, depth };
  };
}

/** Draws the quads that cast, far to near, shaded by how they face the light.
 * @param {CanvasRenderingContext2D} context @param {Json[]} objects @param {Json} camera @param {Vec3} light */
export function draw_casters(context, objects, camera, light) {
  const { width, height } = context.canvas;
  const project = projection(camera, width / height);
  const faces = [];
  for (const { quad, casts } of objects) {
    if (!quad || casts === false) continue;
    const normal = normalized(cross(quad.half_u, quad.half_v));
    if (dot(normal, subtract(camera.eye, quad.center)) <= 0) continue;
    const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([s, t]) =>
      project(/** @type {Vec3} */ (quad.center.map((/** @type {number} */ c, /** @type {number} */ i) => c + s * quad.half_u[i] + t * quad.half_v[i]))),
    );
    if (corners.some((corner) => corner.depth <= 0)) continue;
    // A light in the middle of a side has no direction to it.
    const along = subtract(light, quad.center);
    const facing = Math.max(0, dot(normal, along)) / (length(along) || 1);
    faces.push({ corners, facing, depth: corners.reduce((sum, corner) => sum + corner.depth, 0) });
  }
  faces.sort((a, b) => b.depth - a.depth);
  for (const { corners, facing } of faces) {
    const grey = Math.round(105 + 110 * facing);
    context.fillStyle = `rgb(${grey} ${grey + 3} ${grey + 8})`;
    context.strokeStyle = context.fillStyle;
    context.beginPath();
    for (const { x, y } of corners) context.lineTo(x * width, y * height);
    context.closePath();
    context.fill();
    context.stroke();
  }
}
