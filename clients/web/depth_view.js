// @ts-check
// The depth that the service reads from an image, at few pixels: how far away is what it shows, and what is lit while the light moves.
// The service knows formats, encodings and channels, so one request asks it.
import { decode_pfm, encode_pfm, thinned } from "./pfm.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./client.js").Json} Json */
/** `file` holds planar depth, `caster` the same at fewer pixels yet: what casts is fitted and traced, which takes longer than to be shaded.
 * `size` is that of the image itself.
 * @typedef {{file: Blob, caster: Blob, width: number, height: number, size: [number, number], median: number}} DepthView */

/** The most pixels that a side of it has: a mask of that size takes tens of milliseconds, and is drawn across a whole page. */
const SIDE = 512;
/** As many as that of what casts: an image that has no more is lit as it is. */
export const CASTER_SIDE = 256;

/** The median of what is finite; nothing where nothing is. @param {Float32Array} depth */
export function median_of(depth) {
  const seen = depth.filter(Number.isFinite).sort();
  return seen.length > 0 ? seen[seen.length >> 1] : null;
}

/** @param {Client} client @param {string} name @param {Blob} file @param {Json} encoding @param {number} vertical_fov_deg
 * @returns {Promise<DepthView>} */
export async function depth_view(client, name, file, encoding, vertical_fov_deg) {
  const camera = { kind: "pinhole", eye: [0, 0, 0], target: [0, 0, -1], up: [0, 1, 0], vertical_fov_deg };
  const light = { kind: "point", center: [0, 0, 0], direction: [0, 0, -1] };
  const scene = { penumbra: 1, light, receivers: { camera, depth: name, encoding } };
  const { buffer, size } = await client.depth(scene, new Map([[name, file]]), SIDE);
  const image = decode_pfm(buffer);
  const median = median_of(image.pixels);
  if (median === null) throw new Error(`${name}: no pixel has a depth; is the encoding right?`);
  const { width, height } = image;
  return { file: new Blob([buffer]), caster: encode_pfm(thinned(image, CASTER_SIDE)), width, height, size, median };
}
