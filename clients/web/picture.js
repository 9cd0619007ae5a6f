// @ts-check
// The picture that a depth image belongs to, under the mask's light alone: times the mask, in linear light, as `penumbra mask --over` does it.

/** @typedef {import("./pfm.js").FloatImage} FloatImage */

/** Shapes that differ by no more than this are drawn over each other. */
const ASPECT_TOLERANCE = 0.01;
/** Steps of linear light in the table that encodes it: the steepest part of sRGB, 12.92 x 255 codes, moves by 1/20 of a code a step. */
const STEPS = 65536;

// IEC 61966-2-1.
const linear = (/** @type {number} */ encoded) => (encoded <= 0.04045 ? encoded / 12.92 : ((encoded + 0.055) / 1.055) ** 2.4);
const encoded = (/** @type {number} */ value) => (value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055);

const DECODE = Float32Array.from({ length: 256 }, (_, code) => STEPS * linear(code / 255));
const ENCODE = Uint8Array.from({ length: STEPS + 1 }, (_, step) => Math.round(255 * encoded(step / STEPS)));

export class Picture {
  /** @type {{width: number, height: number, samples: Float32Array} | null} the samples as they were last asked for */
  #held = null;

  /** @param {string} name @param {ImageBitmap} bitmap */
  constructor(name, bitmap) {
    this.name = name;
    this.bitmap = bitmap;
  }

  /** Reads a file. @param {File} file */
  static async read(file) {
    try {
      return new Picture(file.name, await createImageBitmap(file));
    } catch {
      throw new Error(`${file.name}: this browser cannot read it as a picture; expected a JPEG or a PNG`);
    }
  }

  get size() {
    return `${this.bitmap.width} x ${this.bitmap.height}`;
  }

  /** Whether it has the mask's shape, within 1 %. @param {FloatImage} mask */
  fits(mask) {
    const ratio = (this.bitmap.width * mask.height) / (this.bitmap.height * mask.width);
    return Math.abs(ratio - 1) <= ASPECT_TOLERANCE;
  }

  /** What to say about the picture over this mask. @param {FloatImage} mask */
  said_of(mask) {
    const size = `${mask.width} x ${mask.height}`;
    if (!this.fits(mask)) return `${this.name} is ${this.size} and the mask ${size}: their shapes differ by more than 1 %. The picture has to show what the depth shows.`;
    const scaled = this.size === size ? "" : ` It is ${this.size}, drawn at the mask's ${size}.`;
    return `${this.name} under this light alone: picture times mask, in linear light.${scaled}`;
  }

  /** Linear samples of the whole picture at that size, three a pixel, 0 to STEPS. @param {number} width @param {number} height */
  #samples(width, height) {
    if (this.#held?.width === width && this.#held.height === height) return this.#held.samples;
    const context = /** @type {OffscreenCanvasRenderingContext2D} */ (new OffscreenCanvas(width, height).getContext("2d"));
    context.imageSmoothingQuality = "high";
    context.drawImage(this.bitmap, 0, 0, width, height);
    const { data } = context.getImageData(0, 0, width, height);
    const samples = new Float32Array(3 * width * height);
    for (let from = 0, to = 0; from < data.length; from += 4, to += 3)
      for (let channel = 0; channel < 3; channel++) samples[to + channel] = DECODE[data[from + channel]];
    this.#held = { width, height, samples };
    return samples;
  }

  /** The picture under the light of a mask that it fits. @param {FloatImage} mask */
  under(mask) {
    const { width, height, channels, pixels } = mask;
    const samples = this.#samples(width, height);
    const image = new ImageData(width, height);
    const { data } = image;
    // A grey mask's one value counts for all three.
    const [green, blue] = channels === 3 ? [1, 2] : [0, 0];
    for (let from = 0, seen = 0, to = 0; from < samples.length; from += 3, seen += channels, to += 4) {
      data[to] = ENCODE[(samples[from] * pixels[seen] + 0.5) | 0];
      data[to + 1] = ENCODE[(samples[from + 1] * pixels[seen + green] + 0.5) | 0];
      data[to + 2] = ENCODE[(samples[from + 2] * pixels[seen + blue] + 0.5) | 0];
      data[to + 3] = 255;
    }
    return image;
  }
}
