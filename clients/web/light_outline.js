// @ts-check
// The light in the picture: its outline at its place, and an arrow along which it shines. Out of the picture, a mark at the edge points to it.
import { camera_axes } from "./casters.js";
import { axes_of, direction_of } from "./light.js";
import { add, dot, length, scale, subtract } from "./vector.js";

/** @typedef {import("./vector.js").Vec3} Vec3 */
/** @typedef {import("./light.js").Light} Light */
/** @typedef {import("./client.js").Json} Json */
/** A point of the image, in pixels. @typedef {[number, number]} Pixel */

/** The arrow goes this far to the aim. */
const ARROW_SHARE = 0.3;
const ROUND = 32;
/** What is nearer to the camera than this share of the light's distance is cut off. */
const NEAR_SHARE = 1e-3;
const EDGE_PX = 16;

/** @param {Vec3} center @param {Vec3} u @param {Vec3} v half axes */
const disc = (center, u, v) =>
  Array.from({ length: ROUND }, (_, i) => {
    const angle = (2 * Math.PI * i) / ROUND;
    return add(center, add(scale(u, Math.cos(angle)), scale(v, Math.sin(angle))));
  });

/** Where the light is, as a closed line; a directional light has no place, a point no extent.
 * @param {Light} light @param {{right: Vec3, up: Vec3}} camera @returns {Vec3[]} */
export function outline_of(light, camera) {
  const { position } = light;
  if (light.kind === "sphere") return disc(position, scale(camera.right, light.radius), scale(camera.up, light.radius));
  if (light.kind !== "rectangle") return [];
  const { u, v } = axes_of(direction_of(light));
  const side = (/** @type {number} */ s, /** @type {number} */ t) => add(position, add(scale(u, (s * light.width) / 2), scale(v, (t * light.length) / 2)));
  return [side(-1, -1), side(1, -1), side(1, 1), side(-1, 1)];
}

/** A closed or open line without what is behind the camera, in the camera's space: x right, y up, z the distance along its axis.
 * @param {Vec3[]} points @param {number} near @param {boolean} closed */
export function before_camera(points, near, closed) {
  /** @type {Vec3[]} */
  const kept = [];
  points.forEach((point, i) => {
    const last = points[(i + points.length - 1) % points.length];
    if ((i > 0 || closed) && point[2] >= near !== last[2] >= near) {
      const share = (near - last[2]) / (point[2] - last[2]);
      kept.push(add(last, scale(subtract(point, last), share)));
    }
    if (point[2] >= near) kept.push(point);
  });
  return kept;
}

/** Draws the light. @param {CanvasRenderingContext2D} context @param {Light} light @param {Json} camera @param {string} colour */
export function draw_light(context, light, camera, colour) {
  const { width, height } = context.canvas;
  const axes = camera_axes(camera);
  const seen = (/** @type {Vec3} */ point) => {
    const along = subtract(point, camera.eye);
    return /** @type {Vec3} */ ([dot(along, axes.right), dot(along, axes.up), dot(along, axes.forward)]);
  };
  const pixels = height / (2 * axes.tangent);
  const pixel = (/** @type {Vec3} */ [x, y, z]) => /** @type {Pixel} */ ([width / 2 + (pixels * x) / z, height / 2 - (pixels * y) / z]);
  const near = NEAR_SHARE * Math.max(length(subtract(light.target, camera.eye)), length(subtract(light.position, camera.eye)));
  const line = (/** @type {Vec3[]} */ points, /** @type {boolean} */ closed) => before_camera(points.map(seen), near, closed).map(pixel);

  const place = seen(light.position);
  const at = place[2] >= near ? pixel(place) : null;
  const ink = ink_of(context, colour);
  const tip = add(light.position, scale(subtract(light.target, light.position), ARROW_SHARE));
  const arrow = line([light.position, tip], false);
  ink.arrow(arrow);
  ink.outline(line(outline_of(light, axes), true));
  const inside = (/** @type {Pixel | null | undefined} */ point) => point && point[0] >= 0 && point[0] <= width && point[1] >= 0 && point[1] <= height;
  if (at && inside(at)) ink.dot(at);
  else if (!inside(arrow.at(-1))) ink.mark(at ? [at[0] - width / 2, at[1] - height / 2] : [place[0], -place[1]]);
}

/** Lines that are seen on black and on white. @param {CanvasRenderingContext2D} context @param {string} colour */
function ink_of(context, colour) {
  const { width, height } = context.canvas;
  const ratio = devicePixelRatio || 1;
  const stroke = (/** @type {Path2D} */ path) => {
    context.lineJoin = context.lineCap = "round";
    for (const [style, wide] of /** @type {[string, number][]} */ ([["rgb(20 19 17 / 60%)", 4], [colour, 2]])) {
      context.strokeStyle = style;
      context.lineWidth = wide * ratio;
      context.stroke(path);
    }
  };
  const path_of = (/** @type {Pixel[]} */ points, /** @type {boolean} */ closed) => {
    const path = new Path2D();
    for (const point of points) path.lineTo(...point);
    if (closed) path.closePath();
    return path;
  };
  /** Two strokes back from an end. @param {Pixel} from @param {Pixel} to @param {number} size */
  const head = ([x0, y0], [x1, y1], size) => {
    const angle = Math.atan2(y1 - y0, x1 - x0);
    const back = (/** @type {number} */ turn) => /** @type {Pixel} */ ([x1 - size * Math.cos(angle + turn), y1 - size * Math.sin(angle + turn)]);
    return path_of([back(0.5), [x1, y1], back(-0.5)], false);
  };
  return {
    outline(/** @type {Pixel[]} */ points) {
      if (points.length < 2) return;
      const path = path_of(points, true);
      context.globalAlpha = 0.35;
      context.fillStyle = colour;
      context.fill(path);
      context.globalAlpha = 1;
      stroke(path);
    },
    arrow(/** @type {Pixel[]} */ points) {
      if (points.length !== 2) return;
      stroke(path_of(points, false));
      const drawn = Math.hypot(points[1][0] - points[0][0], points[1][1] - points[0][1]);
      stroke(head(points[0], points[1], Math.min(10 * ratio, drawn / 2)));
    },
    dot([x, y] = /** @type {Pixel} */ ([0, 0])) {
      context.beginPath();
      context.arc(x, y, 4 * ratio, 0, 2 * Math.PI);
      context.fillStyle = colour;
      context.fill();
    },
    /** At the edge, in a direction from the middle. */
    mark([dx, dy] = /** @type {Pixel} */ ([0, 0])) {
      const edge = EDGE_PX * ratio;
      const share = Math.min((width / 2 - edge) / (Math.abs(dx) || 1e-9), (height / 2 - edge) / (Math.abs(dy) || 1e-9));
      const end = /** @type {Pixel} */ ([width / 2 + share * dx, height / 2 + share * dy]);
      stroke(head([width / 2, height / 2], end, edge));
    },
  };
}
