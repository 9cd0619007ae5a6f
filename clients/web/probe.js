// @ts-check
// How far away is what a depth image shows? The service knows its formats and encodings, so it is asked. Cards stand one behind the other
// before the camera, and a point light among them shines away from it: all that is further than the next card is hidden. What stands behind
// the light has visibility 1. Moving the light from card to card, by bisection, gives the median; the scene is sent and fitted once.
import { decode_pfm } from "./pfm.js";

/** @typedef {import("./client.js").Client} Client */
/** @typedef {import("./client.js").Json} Json */

/** Distances of the cards: each is so many times as far as the one before. */
const RATIO = 17 / 16;
const NEAREST = 1e-6, FURTHEST = 1e9;
/** Wider than the view at any distance: a view of 170 degrees has a tangent of 11.4 up, and 16 times that to the side is a wide picture. */
const HALF = 200;

const distance_of = (/** @type {number} */ card) => NEAREST * RATIO ** card;

/** The median depth of an image, within a sixteenth.
 * @param {Client} client @param {string} name @param {Blob} file @param {Json} encoding @param {number} vertical_fov_deg */
export async function median_depth(client, name, file, encoding, vertical_fov_deg) {
  const camera = { kind: "pinhole", eye: [0, 0, 0], target: [0, 0, -1], up: [0, 1, 0], vertical_fov_deg };
  const last = Math.ceil(Math.log(FURTHEST / NEAREST) / Math.log(RATIO));
  const cards = Array.from({ length: last + 1 }, (_, card) => {
    const d = distance_of(card);
    return { quad: { center: [0, 0, -d], half_u: [HALF * d, 0, 0], half_v: [0, HALF * d, 0] }, receives: false };
  });
  const files = new Map([[name, file]]);
  const hidden_behind = async (/** @type {number} */ card) => {
    const scene = {
      penumbra: 1,
      light: { kind: "point", center: [0, 0, -distance_of(card - 0.5)], direction: [0, 0, -1] },
      objects: cards,
      receivers: { camera, depth: name, encoding },
      technique: { kind: "ray_traced", samples: 1 },
    };
    const { buffer } = await client.mask(scene, files, "image/x-portable-floatmap");
    return decode_pfm(buffer).pixels.reduce((count, visibility) => count + (visibility < 0.5 ? 1 : 0), 0);
  };

  const all = await hidden_behind(0);
  if (all === 0) throw new Error(`${name}: no pixel is further than 0.000001 scene units; is the encoding right?`);
  if ((await hidden_behind(last)) * 2 > all) throw new Error(`${name}: most pixels are further than ${FURTHEST} scene units; is the encoding right?`);
  let low = 0, high = last;
  while (high - low > 1) {
    const middle = Math.round((low + high) / 2);
    if ((await hidden_behind(middle)) * 2 > all) low = middle;
    else high = middle;
  }
  return distance_of((low + high) / 2);
}
