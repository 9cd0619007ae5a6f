// @ts-check
// Portable float maps, the format in which masks come while the light moves: exact, and cheap on both sides.

/** An image of float samples; row 0 is the top, channels are interleaved.
 * @typedef {{width: number, height: number, channels: 1 | 3, pixels: Float32Array}} FloatImage */

/** The header's words and the offset of the samples: one character of white space ends the last word.
 * @param {Uint8Array} bytes @param {number} count */
function words_of(bytes, count) {
  const words = [];
  let at = 0;
  const is_space = (/** @type {number} */ code) => code === 32 || (code >= 9 && code <= 13);
  while (words.length < count) {
    while (at < bytes.length && is_space(bytes[at])) at++;
    let word = "";
    while (at < bytes.length && !is_space(bytes[at]) && word.length < 32) word += String.fromCharCode(bytes[at++]);
    if (word === "" || at >= bytes.length || !is_space(bytes[at])) throw new Error("the float map ends in its header");
    words.push(word);
    at++;
  }
  return { words, at };
}

const host_is_little = new Uint8Array(new Uint16Array([1]).buffer)[0] === 1;

/** Samples of the other byte order. @param {ArrayBuffer} buffer @param {number} at */
function swapped(buffer, at) {
  const view = new DataView(buffer, at);
  return Float32Array.from({ length: view.byteLength / 4 }, (_, i) => view.getFloat32(4 * i, !host_is_little));
}

/** @param {ArrayBuffer} buffer @returns {FloatImage} */
export function decode_pfm(buffer) {
  const { words, at } = words_of(new Uint8Array(buffer), 4);
  if (words[0] !== "Pf" && words[0] !== "PF") throw new Error(`a float map begins with Pf or PF, not "${words[0]}"`);
  const channels = words[0] === "PF" ? 3 : 1;
  const [width, height, scale] = words.slice(1).map(Number);
  if (!(Number.isInteger(width) && Number.isInteger(height) && width > 0 && height > 0))
    throw new Error(`the float map has a size of ${words[1]} x ${words[2]}`);
  if (!Number.isFinite(scale) || scale === 0) throw new Error(`the float map's scale is ${words[3]}, which must be a number other than 0`);
  const row = width * channels;
  const expected = row * height * 4;
  if (buffer.byteLength - at !== expected)
    throw new Error(`the float map has ${buffer.byteLength - at} bytes of samples; ${width} x ${height} x ${channels} takes ${expected}`);

  // A negative scale means little-endian; rows stand bottom up.
  const samples = (scale < 0) === host_is_little ? new Float32Array(buffer.slice(at)) : swapped(buffer, at);
  const pixels = new Float32Array(samples.length);
  for (let y = 0; y < height; y++) pixels.set(samples.subarray(y * row, (y + 1) * row), (height - 1 - y) * row);
  return { width, height, channels, pixels };
}

/** A grey one as a file. @param {FloatImage} image */
export function encode_pfm({ width, height, pixels }) {
  const rows = [];
  for (let y = height - 1; y >= 0; y--) rows.push(pixels.slice(y * width, (y + 1) * width));
  return new Blob([`Pf\n${width} ${height}\n${host_is_little ? -1 : 1}\n`, ...rows]);
}

/** Pixels of a grey image, so many apart that no side is longer than `side`: the one under the middle of each.
 * @param {FloatImage} image @param {number} side @returns {FloatImage} */
export function thinned({ width, height, pixels }, side) {
  const longest = Math.max(width, height, side);
  const [w, h] = [width, height].map((length) => Math.max(1, Math.floor((length * side) / longest)));
  const place = (/** @type {number} */ i, /** @type {number} */ of, /** @type {number} */ among) => Math.floor(((2 * i + 1) * among) / (2 * of));
  const kept = Float32Array.from({ length: w * h }, (_, i) => pixels[place(Math.floor(i / w), h, height) * width + place(i % w, w, width)]);
  return { width: w, height: h, channels: 1, pixels: kept };
}
