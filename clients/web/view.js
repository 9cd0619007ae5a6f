// @ts-check
// The mask on the screen, or the picture under its light: alone, wiped against another, or as the difference of two masks.
import { difference_image } from "./metrics.js";

/** @typedef {import("./pfm.js").FloatImage} FloatImage */
/** @typedef {"mask" | "wipe" | "difference"} Mode */
/** @typedef {"mask" | "picture"} Shows */
/** @typedef {"values" | "light"} Tone as the PNG holds them, or encoded as sRGB as a viewer of linear images shows them */

/** Full colour of the difference view. */
export const DIFFERENCE_SCALE = 0.1;

/** Opaque grey of a visibility, by table: 4096 steps are finer than 8 bits everywhere but in sRGB's first 1/4096.
 * @param {Tone} tone */
function table_of(tone) {
  const encode = (/** @type {number} */ v) => (tone === "values" ? v : v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
  const bytes = new Uint8ClampedArray(4 * 4097);
  for (let i = 0; i <= 4096; i++) {
    bytes.fill(Math.round(255 * encode(i / 4096)), 4 * i, 4 * i + 3);
    bytes[4 * i + 3] = 255;
  }
  return bytes;
}

/** @param {FloatImage} mask @param {Uint8ClampedArray} table */
function grey_of(mask, table) {
  const image = new ImageData(mask.width, mask.height);
  const { pixels } = mask;
  const at = (/** @type {number} */ sample) => (4096 * pixels[sample] + 0.5) | 0;
  if (mask.channels === 1) {
    // Four bytes at a time.
    const colours = new Uint32Array(table.buffer), data = new Uint32Array(image.data.buffer);
    for (let i = 0; i < data.length; i++) data[i] = colours[at(i)];
    return image;
  }
  for (let i = 0, to = 0; i < pixels.length; i += 3, to += 4) {
    for (let channel = 0; channel < 3; channel++) image.data[to + channel] = table[4 * at(i + channel)];
    image.data[to + 3] = 255;
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
  /** @type {import("./picture.js").Picture | null} */
  picture = null;
  /** @type {Shows} what is wished for; the picture needs one that fits the mask */
  shows = "mask";

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

  /** Whether the picture is what is seen. */
  get shows_picture() {
    return this.shows === "picture" && this.mode !== "difference" && this.picture !== null && this.a !== null && this.picture.fits(this.a);
  }

  /** @param {FloatImage} mask */
  #image_of(mask) {
    return this.shows_picture && this.picture ? this.picture.under(mask) : grey_of(mask, this.#table);
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
    this.context.putImageData(this.#image_of(a), 0, 0);
    if (!b || !this.comparable || this.mode !== "wipe") return;
    const from = Math.round(this.wipe * a.width);
    this.context.putImageData(this.#image_of(b), 0, 0, from, 0, a.width - from, a.height);
  }
}
