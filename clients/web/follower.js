// @ts-check
// Masks follow the state: a queue of requests for what moves and one for what is slow, of which the latest wins.
import { ServiceError } from "./client.js";
import { Outage } from "./outage.js";
import { decode_pfm } from "./pfm.js";
import { LatestQueue } from "./queue.js";

/** @typedef {import("./scene.js").Source} Source */
/** @typedef {import("./technique_panel.js").Choice} Choice */
/** @typedef {import("./client.js").MaskReply} MaskReply */
/** What a mask is of, beside the light's place. @typedef {{choice: Choice, source: Source, light: string}} Of */
/** @typedef {{source: Source, light: string, a: Choice, b: Choice, draft: Choice | null, stand_in: Choice | null, comparing: boolean, eased: boolean}} State
 *   `draft`: what is seen in A's place while the light moves; `stand_in`: what is where A turns out to be slow;
 *   `eased`: A has a coarse map, as the light touches a caster */

/** The second mask follows the light at once when it takes less than this; else, as a mask that was drafted, when the light has rested that
 * long. */
const FOLLOWS_MS = 150;

/** A large image's mask takes seconds of the service, which a light that moves on would share: it is asked for when the light has rested longer. */
const LARGE_RESTS_MS = 800;
/** Twenty masks a second leave 50 ms for each, of which the page draws in ten. A mask that takes longer is drafted while the light moves. */
const PACE_MS = 40;
/** A mask that takes longer has another stand in, and a light that moves on does not wait for it. */
const PATIENCE_MS = 700;

/** Whether two are one scene, whatever picture is laid over it. @param {Source} one @param {Source} other */
const same_scene = (one, other) => one.objects === other.objects && one.occluders === other.occluders && one.receivers === other.receivers;

/** @param {Of} one @param {Of} other */
const same = (one, other) => same_scene(one.source, other.source) && one.light === other.light && JSON.stringify(one.choice) === JSON.stringify(other.choice);

export class Follower {
  /** What moves with the light. */
  #queue = new LatestQueue();
  /** What takes long, while a draft or a first mask is shown: a light that moves again does not wait for it. */
  #slow_queue = new LatestQueue();
  #rest_timer = 0;
  /** Counts changes: a mask belongs to one. */
  version = 0;
  /** What is seen. `refused`: the service had an error for what was asked for last; `refused_in_full`: the version of the last that was no draft. */
  shown = {
    a: /** @type {MaskReply | null} */ (null), a_version: -1, a_of: /** @type {Of | null} */ (null), draft: false, refused: false, refused_in_full: -1,
    b: /** @type {MaskReply | null} */ (null), b_version: -1, b_of: /** @type {Of | null} */ (null),
  };
  /** Masks of earlier versions come too late: they are of another scene. */
  #oldest = 0;
  /** How long the last draft and the last mask in full took, from asking for them to the last byte. */
  #taken_ms = { draft: 0, full: Infinity };

  /** @param {import("./view.js").View} view @param {Outage} outage @param {import("./busy.js").Busy} busy
   * @param {{state: () => State, ask: (choice: Choice, draft: boolean) => Promise<MaskReply>, show: () => void,
   *          came: (whose: "a" | "b", choice: Choice) => void, failed: (error: unknown, whose: string, kept: boolean) => void}} page `kept`: the last mask stays in sight */
  constructor(view, outage, busy, page) {
    this.view = view;
    this.outage = outage;
    this.busy = busy;
    this.page = page;
  }

  /** Whether A's mask is not that of the state as it is, and whether its technique, settings or scene are others. */
  get stale() {
    const { a_of, a_version, refused, draft } = this.shown;
    const { a, draft: quick, stand_in, source, light } = this.page.state();
    const now = (/** @type {Choice | null} */ choice) => choice !== null && a_of !== null && same(a_of, { choice, source, light });
    return { late: a_version !== this.version || refused, other: !(now(a) || (draft && (now(quick) || now(stand_in)))) };
  }

  /** Times of another technique or scene say nothing. */
  forget_times() {
    this.#taken_ms = { draft: 0, full: Infinity };
  }

  /** What is asked for in A's place while the light moves; nothing where A's own is as quick, or keeps pace. */
  #draft() {
    const { draft, stand_in, a, source } = this.page.state();
    const { full, draft: quick } = this.#taken_ms;
    if (draft) return full > quick ? draft : null;
    if (full < PACE_MS || full === Infinity) return null;
    return (full > PATIENCE_MS && stand_in) || (source.small && a);
  }

  /** B's mask is of something else: it does not stand under the new name. */
  #drop_b() {
    this.view.b = this.shown.b = this.shown.b_of = null;
    this.page.show();
  }

  /** Masks of another scene that are still on their way come too late. */
  forget_masks() {
    this.view.b = this.shown.b = this.shown.b_of = null;
    this.#oldest = this.version + 1;
  }

  /** Asks for masks of the state as it is now. @param {boolean} [light_moved] whether the light alone has changed, or all is new: a draft does first */
  update(light_moved = false) {
    this.version++;
    const { b, source, light, draft } = this.page.state();
    const { b_of } = this.shown;
    if (b_of && !same(b_of, { choice: b, source, light })) this.#drop_b();
    if (this.#draft() && !light_moved) this.#slow_queue.push(() => this.#update_a(null));
    else this.#queue.push(() => this.#follow());
    clearTimeout(this.#rest_timer);
    const asked = this.version;
    const rest_ms = draft && source.small ? LARGE_RESTS_MS : FOLLOWS_MS;
    const when_rested = () => {
      if (asked !== this.version) return;
      if (this.#queue.busy) this.#rest_timer = setTimeout(when_rested, rest_ms);
      else this.#slow_queue.push(() => this.#complete(asked));
    };
    this.#rest_timer = setTimeout(when_rested, rest_ms);
  }

  /** What is missing when the light rests: A in full, and B. @param {number} asked the version that rested */
  async #complete(asked) {
    if (asked !== this.version) return;
    const { shown } = this;
    if (shown.draft || shown.a_version !== this.version) await this.#update_a(null);
    // Without a first mask there is nothing to compare with, and its error is what the user should read.
    if (this.page.state().comparing && asked === this.version && shown.b_version !== this.version && shown.a && !shown.refused) await this.#update_b();
  }

  /** @param {number} asked @param {number} seen the version that is */
  #too_late(asked, seen) {
    return asked < Math.max(seen, this.#oldest);
  }

  /** @param {Choice} choice @param {boolean} draft */
  async #ask(choice, draft) {
    const end = this.busy.begin(`computing ${choice.kind}${draft ? ", a draft" : ""}`);
    try {
      const reply = await this.page.ask(choice, draft);
      this.outage.over();
      return { reply, mask: decode_pfm(reply.buffer) };
    } catch (error) {
      // An answer, too.
      if (error instanceof ServiceError && !Outage.is(error)) this.outage.over();
      throw error;
    } finally {
      end();
    }
  }

  /** A, or what is asked for in its place by what is known of its time now; where that takes long, what is quicker stands in. */
  async #follow() {
    const asked = this.version;
    const { stand_in, source, a } = this.page.state();
    const draft = this.#draft();
    const quick = stand_in ?? (draft ? null : source.small && a);
    const job = this.#update_a(draft);
    if (!quick || draft?.kind === quick.kind) return job;
    const patience = new Promise((then) => setTimeout(() => then("over"), PATIENCE_MS));
    if ((await Promise.race([job, patience])) !== "over" || this.outage.waiting) return job;
    this.#taken_ms.full = 2 * PATIENCE_MS;
    // One slow mask at a time: it may go on for long where the light has moved on.
    this.#slow_queue.push(() => job);
    if (asked === this.version) await this.#update_a(quick);
  }

  /** @param {Choice | null} draft */
  async #update_a(draft) {
    const asked = this.version;
    const { shown } = this;
    const { a, source, light, comparing } = this.page.state();
    const choice = draft ?? a;
    try {
      const { reply, mask } = await this.#ask(choice, draft !== null);
      // The light has gone on, and its draft is there already.
      if (this.#too_late(asked, shown.a_version)) return;
      // What it stands in for is there already, or is refused: the error is what the user should read.
      if (draft && (shown.refused_in_full === asked || (shown.a_version === asked && !shown.draft && !shown.refused))) return;
      if (JSON.stringify(a) === JSON.stringify(this.page.state().a)) this.#taken_ms[draft ? "draft" : "full"] = reply.ms;
      this.view.a = mask;
      Object.assign(shown, { a: reply, a_version: asked, a_of: { choice, source, light }, draft: draft !== null, refused: false });
      this.page.came("a", choice);
    } catch (error) {
      if (this.#too_late(asked, shown.a_version)) return;
      if (Outage.is(error)) {
        await this.outage.wait(error);
        // What has changed meanwhile waits in the queue.
        return asked === this.version ? this.#update_a(draft) : undefined;
      }
      this.#refused(error, asked, choice, draft, source);
    }
    this.page.show();
    if (!draft && comparing && shown.b && shown.b.ms < FOLLOWS_MS && asked === this.version) await this.#update_b();
  }

  /** @param {unknown} error @param {number} asked @param {Choice} choice @param {Choice | null} draft @param {Source} source */
  #refused(error, asked, choice, draft, source) {
    const { shown } = this;
    // A draft stays in sight: it is right for what it is.
    const drafted = !draft && shown.draft && shown.a_version === asked;
    const kept = shown.a !== null && shown.a_of !== null && same_scene(shown.a_of.source, source);
    if (!kept) shown.a = null;
    Object.assign(shown, { a_version: asked, refused: !drafted });
    if (!draft) shown.refused_in_full = asked;
    this.page.failed(error, drafted ? `${choice.kind}: ` : "", kept);
  }

  async #update_b() {
    const asked = this.version;
    const { shown } = this;
    const { b, source, light } = this.page.state();
    try {
      const { reply, mask } = await this.#ask(b, false);
      if (this.#too_late(asked, shown.b_version)) return;
      this.view.b = mask;
      Object.assign(shown, { b: reply, b_version: asked, b_of: { choice: b, source, light } });
      this.page.came("b", b);
    } catch (error) {
      if (Outage.is(error)) {
        await this.outage.wait(error);
        return asked === this.version ? this.#update_b() : undefined;
      }
      this.view.b = shown.b = null;
      this.page.failed(error, `${b.kind}: `, true);
    }
    this.page.show();
  }
}
