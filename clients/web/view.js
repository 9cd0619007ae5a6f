// @ts-check
// The mask on the screen: alone, wiped against another, or as their difference.
import { difference_image } from "./metrics.js";

/** @typedef {import("./pfm.js").FloatImage} FloatImage */
/** @typedef {"mask" | "wipe" | "difference"} Mode */
/** @typedef {"values" | "light"} Tone as the PNG holds them, or encoded as sRGB as a viewer of linear images shows them */

/** Full colour of the difference view. */
export const DIFFERENCE_SCALE = 0.1;

/** 8-bit value of a visibility, by table: 4096 steps are finer than 8 bits everywhere but in sRGB's first 1/4096.
 * @param {Tone} tone */
function table_of(tone) {
  const encode = (/** @type {number} */ v) => (tone === "values" ? v : v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
  return Uint8ClampedArray.from({ length: 4097 }, (_, i) => Math.round(255 * encode(i / 4096)));
}

/** @param {FloatImage} mask @param {Uint8ClampedArray} table */
function picture_of(mask, table) {
  const image = new ImageData(mask.width, mask.height);
  const { data } = image;
  const step = mask.channels === 3 ? 1 : 0;
  for (let pixel = 0, from = 0, to = 0; pixel < mask.width * mask.height; pixel++, from += mask.channels, to += 4) {
    data[to] = table[Math.round(4096 * mask.pixels[from])];
    data[to + 1] = table[Math.round(4096 * mask.pixels[from + step])];
    data[to + 2] = table[Math.round(4096 * mask.pixels[from + 2 * step])];
    data[to + 3] = 255;
  }
  return image;
}

export class View {
  /** @type {FloatImage | null} */
  a = null;
  /** @type {FloatImage | null} */
  b = null;
  /** @type {Mode} */
  mode = "mask";
  /** @type {Tone} */
  #tone = "values";
  #table = table_of("values");
  wipe = 0.5;

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  }

  /** @param {Tone} tone */
  set tone(tone) {
    this.#tone = tone;
    this.#table = table_of(tone);
  }

  get tone() {
    return this.#tone;
  }

  /** The difference or the wipe needs both masks, of one size. */
  get comparable() {
    return this.a !== null && this.b !== null && this.a.width === this.b.width && this.a.height === this.b.height && this.a.channels === this.b.channels;
  }

  draw() {
    const { a, b } = this;
    if (!a) return;
    if (this.canvas.width !== a.width || this.canvas.height !== a.height) {
      this.canvas.width = a.width;
      this.canvas.height = a.height;
    }
    if (b && this.comparable && this.mode === "difference") {
      this.context.putImageData(difference_image(a, b, DIFFERENCE_SCALE), 0, 0);
      return;
    }
    this.context.putImageData(picture_of(a, this.#table), 0, 0);
    if (!b || !this.comparable || this.mode !== "wipe") return;
    const from = Math.round(this.wipe * a.width);
    this.context.putImageData(picture_of(b, this.#table), 0, 0, from, 0, a.width - from, a.height);
  }
}
