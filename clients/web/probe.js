// @ts-check
// How far away is what a depth image shows? The service knows its formats and encodings, so it is asked: a card at distance d in front of a
// point light at the camera hides all pixels that are further. Bisecting d gives the median.
import { decode_pfm } from "./pfm.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./client.js").Json} Json */

/** The median depth of an image, within a sixteenth.
 * @param {Client} client @param {string} name @param {Blob} file @param {Json} encoding @param {number} vertical_fov_deg */
export async function median_depth(client, name, file, encoding, vertical_fov_deg) {
  const camera = { kind: "pinhole", eye: [0, 0, 0], target: [0, 0, -1], up: [0, 1, 0], vertical_fov_deg };
  // Wider than the view at any distance: a view of 170 degrees has a tangent of 11.4 up, and 16 times that to the side is a wide picture.
  const half = 200;
  const hidden_behind = async (/** @type {number} */ d) => {
    const scene = {
      penumbra: 1,
      light: { kind: "point", center: [0, 0, 0], direction: [0, 0, -1] },
      objects: [{ quad: { center: [0, 0, -d], half_u: [half * d, 0, 0], half_v: [0, half * d, 0] }, receives: false }],
      receivers: { camera, depth: name, encoding },
      technique: { kind: "ray_traced", samples: 1 },
    };
    const { buffer } = await client.mask_once(scene, new Map([[name, file]]), "image/x-portable-floatmap");
    return decode_pfm(buffer).pixels.reduce((count, visibility) => count + (visibility < 0.5 ? 1 : 0), 0);
  };

  const all = await hidden_behind(1e-6);
  if (all === 0) throw new Error(`${name}: no pixel is further than 0.000001 scene units; is the encoding right?`);
  let low = 1, high = 1;
  while ((await hidden_behind(high)) * 2 > all) {
    if (high > 1e9) throw new Error(`${name}: most pixels are further than ${high} scene units; is the encoding right?`);
    low = high;
    high *= 8;
  }
  if (high === 1)
    while (low > 1e-6 && (await hidden_behind((low = high / 8))) * 2 <= all) high = low;
  while (high / low > 17 / 16) {
    const middle = Math.sqrt(low * high);
    if ((await hidden_behind(middle)) * 2 > all) low = middle;
    else high = middle;
  }
  return Math.sqrt(low * high);
}
