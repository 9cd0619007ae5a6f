// @ts-check
// Error figures and false colours between two masks, as `penumbra compare` makes them.

/** @typedef {import("./pfm.js").FloatImage} FloatImage */
/** @typedef {{mae_shadow: number, rmse_shadow: number, bias_shadow: number, p99_shadow: number, max: number,
 *             pixels_shadow: number, pixels: number}} Metrics */

/** A pixel with a channel below this in either mask is a shadow pixel. */
export const SHADOW_BELOW = 0.999;

/** @param {FloatImage} test @param {FloatImage} reference */
function require_same_size(test, reference) {
  for (const key of /** @type {const} */ (["width", "height", "channels"]))
    if (test[key] !== reference[key]) throw new Error(`the masks differ in ${key}: ${test[key]} and ${reference[key]}`);
}

/** The value at position 0.99 (n - 1) of the sorted values, interpolated; 0 without values. Sorts them.
 * @param {Float64Array} values */
function percentile_99(values) {
  if (values.length === 0) return 0;
  values.sort();
  const position = 0.99 * (values.length - 1);
  const below = Math.floor(position);
  const low = values[below];
  return below + 1 < values.length ? low + (position - below) * (values[below + 1] - low) : low;
}

/** Figures of test - reference; `max` is over all pixels, the others over shadow pixels, 0 where there are none.
 * @param {FloatImage} test @param {FloatImage} reference @returns {Metrics} */
export function compare(test, reference) {
  require_same_size(test, reference);
  const { channels } = test;
  const a = test.pixels, b = reference.pixels;
  const magnitudes = new Float64Array(a.length);
  let count = 0, shadow = 0, sum = 0, absolute = 0, square = 0, max = 0;
  for (let first = 0; first < a.length; first += channels) {
    let in_shadow = false;
    for (let i = first; i < first + channels; i++) {
      max = Math.max(max, Math.abs(a[i] - b[i]));
      in_shadow ||= a[i] < SHADOW_BELOW || b[i] < SHADOW_BELOW;
    }
    if (!in_shadow) continue;
    shadow++;
    for (let i = first; i < first + channels; i++) {
      const difference = a[i] - b[i];
      sum += difference;
      absolute += Math.abs(difference);
      square += difference * difference;
      magnitudes[count++] = Math.abs(difference);
    }
  }
  const mean = (/** @type {number} */ total) => (count > 0 ? total / count : 0);
  return {
    mae_shadow: mean(absolute), rmse_shadow: Math.sqrt(mean(square)), bias_shadow: mean(sum),
    p99_shadow: percentile_99(magnitudes.subarray(0, count)), max, pixels_shadow: shadow, pixels: test.width * test.height,
  };
}

/** White where equal, to full blue where the test is darker by `full_scale` or more, to full red where it is lighter.
 * @param {FloatImage} test @param {FloatImage} reference @param {number} full_scale @returns {ImageData} */
export function difference_image(test, reference, full_scale) {
  require_same_size(test, reference);
  const { channels } = test;
  const image = new ImageData(test.width, test.height);
  for (let pixel = 0; pixel < test.width * test.height; pixel++) {
    let largest = 0;
    for (let i = pixel * channels; i < (pixel + 1) * channels; i++) {
      const difference = test.pixels[i] - reference.pixels[i];
      if (Math.abs(difference) > Math.abs(largest)) largest = difference;
    }
    const share = Math.min(Math.abs(largest) / full_scale, 1);
    const fade = Math.round(255 * (1 - share));
    image.data.set([largest < 0 ? fade : 255, fade, largest > 0 ? fade : 255, 255], pixel * 4);
  }
  return image;
}
