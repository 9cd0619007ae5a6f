// @ts-check
// A technique and its keys, as controls made from what the service says of it.
import { button, choice_field, element, flag_field, number_field, prose } from "./fields.js";

/** @typedef {import("./client.js").Technique} Technique */
/** @typedef {import("./client.js").Json} Json */
/** `settings` holds the keys that differ from their defaults. @typedef {{kind: string, settings: Json}} Choice */

/** The widest range that a slider is offered for: each of its steps is then a few pixels wide. */
const SLIDER_STEPS = 128;

/** @param {string} key */
const label_of = (key) => (key.charAt(0).toUpperCase() + key.slice(1)).replaceAll("_", " ");

/** One key's control.
 * @param {string} key @param {Json} schema @param {any} value @param {(value: any) => void} changed */
function control_of(key, schema, value, changed) {
  const common = { label: label_of(key), name: key, help: schema.description ?? "" };
  if (Array.isArray(schema.enum)) {
    // Options are texts; the value that is sent is the schema's own.
    const options = schema.enum.map((/** @type {any} */ one) => /** @type {[string, string]} */ ([String(one), String(one)]));
    return choice_field({ ...common, value: String(value), options }, (text) => changed(schema.enum.find((/** @type {any} */ one) => String(one) === text))).node;
  }
  switch (schema.type) {
    case "boolean":
      return flag_field({ ...common, value }, changed).node;
    case "integer": {
      // Beyond 2^53 a script's numbers are not whole any more.
      const max = schema.maximum === undefined ? undefined : Math.min(schema.maximum, Number.MAX_SAFE_INTEGER);
      const slider = schema.minimum !== undefined && max !== undefined && max - schema.minimum <= SLIDER_STEPS;
      return number_field({ ...common, value, min: schema.minimum, max, step: 1, unit: schema["x-unit"], slider }, changed).node;
    }
    case "number": {
      const bounded = schema.minimum !== undefined && schema.maximum !== undefined;
      return number_field({ ...common, value, min: schema.minimum, max: schema.maximum, unit: schema["x-unit"], slider: bounded }, changed).node;
    }
    default:
      return element("p", { className: "help" }, `${label_of(key)}: this page has no control for the type "${schema.type}"; set it in the scene file.`);
  }
}

/** A technique with the settings that suit a source, as far as it has such keys and they are no defaults.
 * @param {Technique[]} techniques @param {string} kind @param {Json} suggested @returns {Choice} */
export function suggested_choice(techniques, kind, suggested) {
  /** @type {Record<string, Json>} */
  const keys = techniques.find((one) => one.kind === kind)?.schema.properties ?? {};
  const fitting = Object.entries(suggested).filter(([key, value]) => keys[key]?.enum?.includes(value) && keys[key].default !== value);
  return { kind, settings: Object.fromEntries(fitting) };
}

/** Kinds that follow rays, each from every receiver: slow, and what others are drafts of. */
const TRACED = ["depth_trace", "ray_traced"];
/** What makes a draft quick, for techniques that have such a key. @type {Json} */
const DRAFTED = { resolution: 96 };

/** The quick technique that may stand in for a traced one while the light moves: the first of the source's drafts that takes the light.
 * @param {Technique[]} techniques @param {Choice} choice @param {{drafts: string[], suggested: Json}} source @param {string} light its kind
 * @returns {Choice | null} */
export function draft_of(techniques, choice, source, light) {
  if (!TRACED.includes(choice.kind)) return null;
  const kind = source.drafts.find((one) => techniques.some((known) => known.kind === one && known.lights.includes(light)));
  if (!kind) return null;
  const keys = techniques.find((one) => one.kind === kind)?.schema.properties ?? {};
  const quick = Object.fromEntries(Object.entries(DRAFTED).filter(([key]) => key in keys));
  return { kind, settings: { ...suggested_choice(techniques, kind, source.suggested).settings, ...quick } };
}

/** What may stand in for a technique that turns out to be slow, as one may where the light is inside a caster: the first other one of the
 * source's that takes the light.
 * @param {Technique[]} techniques @param {Choice} choice @param {{stand_ins: string[], suggested: Json}} source
 * @param {string} light its kind @returns {Choice | null} */
export function stand_in_of(techniques, choice, source, light) {
  if (TRACED.includes(choice.kind)) return null;
  const fits = (/** @type {string} */ kind) => kind !== choice.kind && techniques.some((known) => known.kind === kind && known.lights.includes(light));
  const kind = source.stand_ins.find(fits);
  return kind ? suggested_choice(techniques, kind, source.suggested) : null;
}

/** Fills `place` with the choice of technique and its controls, and calls `changed` with each new choice.
 * @param {HTMLElement} place @param {Technique[]} techniques @param {Choice} choice
 * @param {{light: string, suggested: Json}} fits kind of the light, and settings that suit the source @param {(choice: Choice) => void} changed */
export function technique_panel(place, techniques, choice, fits, changed) {
  const technique = techniques.find((one) => one.kind === choice.kind);
  const pick = choice_field(
    { label: "Kind", name: "kind", value: choice.kind, options: techniques.map((one) => [one.kind, label_of(one.kind)]) },
    (kind) => {
      const next = suggested_choice(techniques, kind, fits.suggested);
      technique_panel(place, techniques, next, fits, changed);
      place.querySelector("select")?.focus();
      changed(next);
    },
  );
  place.replaceChildren(pick.node);
  if (!technique) return;
  place.append(element("p", { className: "help" }, ...prose(technique.summary)));
  if (!technique.lights.includes(fits.light))
    place.append(element("p", { className: "notice", role: "status" }, `${label_of(technique.kind)} takes no ${fits.light} light; it takes: ${technique.lights.join(", ")}.`));

  const settings = { ...choice.settings };
  const keys = Object.entries(/** @type {Record<string, Json>} */ (technique.schema.properties)).filter(([key]) => key !== "kind");
  for (const [key, schema] of keys) {
    place.append(
      control_of(key, schema, settings[key] ?? schema.default, (value) => {
        if (value === schema.default) delete settings[key];
        else settings[key] = value;
        changed({ kind: choice.kind, settings: { ...settings } });
      }),
    );
  }
  if (keys.length > 0)
    place.append(
      button("Defaults", () => {
        const next = { kind: choice.kind, settings: {} };
        technique_panel(place, techniques, next, fits, changed);
        changed(next);
      }, "quiet"),
    );
}
