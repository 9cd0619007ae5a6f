// @ts-check
// Which of some files is depth, and which a picture: their first bytes decide, then their names.

/** @typedef {"front" | "back" | "receiver" | "depth" | "picture"} Role */
/** @typedef {"JPEG" | "PNG of 8-bit colours" | ""} Look what makes a file look like a picture */

const DEPTH_NAME = /depth|disp|dist|[_-]?gt\b|\bz\b|[_-]z\b/i;
const PNG = [0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a];
/** Colour types of PNG that hold colours: RGB, palette, RGB with alpha. */
const COLOURED = [2, 3, 6];

/** A name that a part of a request may have: the file's own, where it is one.
 * @param {string} given @param {string} role @param {string[]} taken */
export function part_name(given, role, taken) {
  const kept = given.replaceAll(/[^A-Za-z0-9._-]/g, "_").replace(/^\.+/, "").slice(-128);
  const name = kept === "" || kept === "scene" ? role : kept;
  return taken.includes(name) ? `${role}_${name}`.slice(0, 128) : name;
}

/** Which depth map is which, by name, else by order.
 * @param {File[]} files @returns {Partial<Record<Role, File>>} */
export function roles_of(files) {
  if (files.length === 1) return { depth: files[0] };
  /** @type {Partial<Record<Role, File>>} */
  const roles = {};
  const rest = files.filter((file) => {
    const role = /back/i.test(file.name) ? "back" : /recei|floor|ground/i.test(file.name) ? "receiver" : /front|occlu/i.test(file.name) ? "front" : null;
    if (!role || roles[role]) return true;
    roles[role] = file;
    return false;
  });
  for (const role of /** @type {Role[]} */ (["front", "receiver", "back"])) if (!roles[role] && rest.length > 0) roles[role] = rest.shift();
  return roles;
}

/** A JPEG holds no depth; a PNG of 8-bit colours hardly ever does. @param {Blob} file @returns {Promise<Look>} */
export async function look_of(file) {
  const head = new Uint8Array(await file.slice(0, 26).arrayBuffer());
  if (head[0] === 0xff && head[1] === 0xd8 && head[2] === 0xff) return "JPEG";
  // After the signature: length and name of the first chunk, width, height, bits a sample, colour type.
  if (PNG.every((byte, i) => head[i] === byte) && head[24] <= 8 && COLOURED.includes(head[25])) return "PNG of 8-bit colours";
  return "";
}

/** The one picture among some files, or none; the rest is depth. A JPEG is it before a PNG, and of two PNGs that whose name does not speak of
 * depth, else the later.
 * @param {File[]} files @returns {Promise<{depth: File[], picture?: File, look: Look}>} */
export async function picture_among(files) {
  const looks = await Promise.all(files.map(look_of));
  const of = (/** @type {Look} */ look) => files.filter((_, i) => looks[i] === look);
  const jpegs = of("JPEG"), pngs = of("PNG of 8-bit colours");
  if (jpegs.length > 1) throw new Error(`${jpegs.map((file) => file.name).join(" and ")} are pictures (JPEG), which hold no depth; expected a depth image and one picture`);
  const picture = jpegs[0] ?? pngs.filter((file) => !DEPTH_NAME.test(file.name)).at(-1) ?? (files.length > 1 ? pngs.at(-1) : undefined);
  return { depth: files.filter((file) => file !== picture), ...(picture ? { picture } : {}), look: jpegs[0] ? "JPEG" : picture ? "PNG of 8-bit colours" : "" };
}
