// @ts-check
// The service over HTTP. A scene is kept by the service where it can, so that moving the light sends a few hundred bytes.

/** @typedef {Record<string, any>} Json */
/** @typedef {Map<string, Blob>} Files the images that a scene names */
/** @typedef {{name: string, ms: number}} Stage */
/** @typedef {{buffer: ArrayBuffer, stages: Stage[], warnings: string[], ms: number}} MaskReply */
/** @typedef {"mask" | "bound"} MaskImage a mask, or its lowest and highest visibility, which comes as EXR only */
/** @typedef {{kind: string, summary: string, lights: string[], inputs: string, source: string, bounds: boolean, schema: Json}} Technique */

/** The sections that differ from one request to the next of a kept scene. */
const CHANGEABLE = ["light", "technique", "output"];

/** An answer that is no success, in the service's own words. */
export class ServiceError extends Error {
  /** @param {number} status @param {string} detail @param {string} reason @param {number} retry_after_s */
  constructor(status, detail, reason, retry_after_s) {
    super(detail);
    this.status = status;
    this.reason = reason;
    this.retry_after_s = retry_after_s;
  }
}

/** No answer at all: the service does not run, or the way to it is broken. */
export class NoAnswer extends Error {
  constructor() {
    super("the service does not answer");
  }
}

/** What fails on its way. @template T @param {Promise<T>} answer */
const answered = (answer) =>
  answer.catch((error) => {
    throw error instanceof TypeError ? new NoAnswer() : error;
  });

/** @param {Response} response */
async function error_of(response) {
  const text = await answered(response.text());
  /** @type {Json} */
  let problem = {};
  try {
    problem = JSON.parse(text);
  } catch {
    // Not the service's own answer: a proxy's page, say.
  }
  const detail = problem.detail ?? `the answer is ${response.status} ${response.statusText}`;
  return new ServiceError(response.status, detail, problem.reason ?? "", Number(response.headers.get("Retry-After")) || 0);
}

/** @param {string | null} header @returns {Stage[]} */
export function stages_of(header) {
  if (!header) return [];
  return header.split(",").map((entry) => {
    const [name, ...parameters] = entry.trim().split(";");
    const duration = parameters.find((parameter) => parameter.trim().startsWith("dur="));
    return { name, ms: duration ? Number(duration.trim().slice(4)) : 0 };
  });
}

/** @param {Json} scene @param {Files} files */
function form_of(scene, files) {
  const form = new FormData();
  form.append("scene", new Blob([JSON.stringify(scene)], { type: "application/json" }), "scene.json");
  for (const [name, blob] of files) form.append(name, blob, name);
  return form;
}

const query_of = (/** @type {MaskImage} */ image) => (image === "mask" ? "" : `?image=${image}`);

/** The merge patch (RFC 7396) from a kept scene to `scene`. Members merge where the kind is the same, so what is at its default now is taken
 * out; another kind replaces the object.
 * @param {Json} scene @param {Json} kept technique of the kept scene */
export function patch_of(scene, kept) {
  const patch = Object.fromEntries(CHANGEABLE.filter((key) => key in scene).map((key) => [key, scene[key]]));
  if (scene.technique.kind !== kept.kind) return patch;
  const removed = Object.keys(kept).filter((key) => !(key in scene.technique));
  return { ...patch, technique: { ...scene.technique, ...Object.fromEntries(removed.map((key) => [key, null])) } };
}

export class Client {
  /** The bearer token; in memory only. */
  token = "";
  /** False once the service has said that it keeps no scenes. */
  keeps = true;
  /** What is kept, by content, and the technique that it was sent with: promised while it is on its way.
   * @type {Map<string, Promise<{id: string, technique: Json} | null>>} */
  #kept = new Map();
  /** @type {WeakMap<Blob, number>} */
  #numbers = new WeakMap();
  #count = 0;

  /** @param {string} path @param {RequestInit} [init] */
  async #fetch(path, init = {}) {
    const headers = new Headers(init.headers);
    if (this.token) headers.set("Authorization", `Bearer ${this.token}`);
    const response = await answered(fetch(path, { ...init, headers, cache: "no-store" }));
    if (!response.ok) throw await error_of(response);
    return response;
  }

  /** @returns {Promise<Technique[]>} */
  async techniques() {
    return (await (await this.#fetch("/v1/techniques")).json()).techniques;
  }

  /** The device that computes. @returns {Promise<{version: string, device: string}>} */
  async device() {
    const { version, devices } = await (await this.#fetch("/v1/devices")).json();
    return { version, device: devices.find((/** @type {Json} */ d) => d.selected)?.name ?? "" };
  }

  /** The depth of a scene's receivers as a float map, no side longer than `side`, and the size of the image itself.
   * @param {Json} scene @param {Files} files @param {number} side @returns {Promise<{buffer: ArrayBuffer, size: [number, number]}>} */
  async depth(scene, files, side) {
    const response = await this.#fetch(`/v1/depth?side=${side}`, { method: "POST", body: form_of(scene, files) });
    const [width, height] = (response.headers.get("Penumbra-Size") ?? "").split("x").map(Number);
    return { buffer: await answered(response.arrayBuffer()), size: [width, height] };
  }

  /** The mask of a scene that more requests will follow of.
   * @param {Json} scene @param {Files} files @param {string} accept media type @param {MaskImage} [image] */
  mask(scene, files, accept, image = "mask") {
    return this.#timed((begins) => this.#post_kept(scene, files, accept, query_of(image), begins));
  }

  /** The mask of a scene that is asked for once.
   * @param {Json} scene @param {Files} files @param {string} accept media type @param {MaskImage} [image] */
  mask_once(scene, files, accept, image = "mask") {
    return this.#timed(() => this.#post_whole(scene, files, accept, query_of(image)));
  }

  /** `post` may say when the mask itself is asked for: keeping the scene does not count.
   * @param {(begins: () => void) => Promise<Response>} post @returns {Promise<MaskReply>} */
  async #timed(post) {
    let begun = performance.now();
    const response = await post(() => (begun = performance.now()));
    const buffer = await answered(response.arrayBuffer());
    return {
      buffer,
      stages: stages_of(response.headers.get("Server-Timing")),
      warnings: JSON.parse(response.headers.get("Penumbra-Warnings") ?? "[]"),
      ms: performance.now() - begun,
    };
  }

  /** @param {Json} scene @param {Files} files @param {string} accept @param {string} query */
  #post_whole(scene, files, accept, query) {
    return this.#fetch(`/v1/masks${query}`, { method: "POST", body: form_of(scene, files), headers: { Accept: accept } });
  }

  /** @param {Json} scene @param {Files} files @param {string} accept @param {string} query @param {() => void} begins */
  async #post_kept(scene, files, accept, query, begins) {
    const kept = this.keeps ? await this.#keep(scene, files) : null;
    if (!kept) return this.#post_whole(scene, files, accept, query);
    const change = (/** @type {{id: string, technique: Json}} */ { id, technique }) => {
      begins();
      return this.#fetch(`/v1/scenes/${id}/masks${query}`, {
        method: "POST",
        body: JSON.stringify(patch_of(scene, technique)),
        headers: { Accept: accept, "Content-Type": "application/merge-patch+json" },
      });
    };
    try {
      return await change(kept);
    } catch (error) {
      if (!(error instanceof ServiceError && error.status === 404)) throw error;
      // Its time was over: send it again, once for all who wait.
      const key = this.#key(scene, files);
      if ((await this.#kept.get(key)) === kept) this.#kept.delete(key);
      const again = await this.#keep(scene, files);
      return again ? change(again) : this.#post_whole(scene, files, accept, query);
    }
  }

  /** The kept scene; null when the service keeps none.
   * @param {Json} scene @param {Files} files */
  #keep(scene, files) {
    const key = this.#key(scene, files);
    const known = this.#kept.get(key);
    if (known) return known;
    const sent = this.#send(scene, files);
    this.#kept.set(key, sent);
    sent.catch(() => this.#kept.delete(key));
    return sent;
  }

  /** @param {Json} scene @param {Files} files @returns {Promise<{id: string, technique: Json} | null>} */
  async #send(scene, files) {
    try {
      const { id } = await (await this.#fetch("/v1/scenes", { method: "POST", body: form_of(scene, files) })).json();
      return { id, technique: scene.technique };
    } catch (error) {
      if (!(error instanceof ServiceError && (error.status === 404 || error.status === 405 || error.reason === "no_scenes"))) throw error;
      this.keeps = false;
      return null;
    }
  }

  /** @param {Json} scene @param {Files} files */
  #key(scene, files) {
    const fixed = Object.entries(scene).filter(([key]) => !CHANGEABLE.includes(key));
    const numbers = [...files].map(([name, blob]) => {
      if (!this.#numbers.has(blob)) this.#numbers.set(blob, ++this.#count);
      return [name, this.#numbers.get(blob)];
    });
    return JSON.stringify([fixed, numbers]);
  }
}
