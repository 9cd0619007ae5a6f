// @ts-check
// Labelled fields: every control of the page is one of these.

let made = 0;

/** @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag @param {Record<string, any>} [properties] @param {...(Node | string)} children @returns {HTMLElementTagNameMap[T]} */
export function element(tag, properties = {}, ...children) {
  const node = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key in node) /** @type {any} */ (node)[key] = value;
    else node.setAttribute(key, value);
  }
  node.append(...children);
  return node;
}

/** A text of the service or the page: what stands between backticks is code. @param {string} text @returns {(Node | string)[]} */
export const prose = (text) => text.split("`").map((piece, i) => (i % 2 === 1 ? element("code", {}, piece) : piece));

/** A label, a control and, where there is one, a help text that screen readers read with it.
 * @param {string} label @param {HTMLElement} control @param {{help?: string, unit?: string}} texts @param {...Node} more */
function row(label, control, { help = "", unit = "" }, ...more) {
  control.id ||= `field_${++made}`;
  const units = unit ? [element("span", { className: "unit" }, ` ${unit}`)] : [];
  const parts = [element("label", { htmlFor: control.id }, label, ...units), element("div", { className: "control" }, control, ...more)];
  if (help) {
    const text = element("p", { className: "help", id: `${control.id}_help` }, ...prose(help));
    control.setAttribute("aria-describedby", text.id);
    parts.push(text);
  }
  return element("div", { className: "field" }, ...parts);
}

/** @param {{label: string, value: string, options: [string, string][], help?: string, name?: string}} given
 * @param {(value: string) => void} changed */
export function choice_field({ label, value, options, help = "", name = "" }, changed) {
  const select = element("select", { name }, ...options.map(([key, text]) => element("option", { value: key, selected: key === value }, text)));
  select.addEventListener("change", () => changed(select.value));
  return { node: row(label, select, { help }), control: select };
}

/** @param {{label: string, value: boolean, help?: string, name?: string}} given @param {(value: boolean) => void} changed */
export function flag_field({ label, value, help = "", name = "" }, changed) {
  const box = element("input", { type: "checkbox", checked: value, name });
  box.addEventListener("change", () => changed(box.checked));
  return { node: row(label, box, { help }), control: box };
}

/** A number field, with a slider beside it where `slider` is set. What the range does not hold is marked and not passed on.
 * @param {{label: string, value: number, min?: number, max?: number, step?: number | "any", unit?: string, help?: string, name?: string,
 *          slider?: boolean}} given
 * @param {(value: number) => void} changed */
export function number_field({ label, value, min, max, step = "any", unit = "", help = "", name = "", slider = false }, changed) {
  const box = element("input", { type: "number", name, step: String(step), required: true });
  if (min !== undefined) box.min = String(min);
  if (max !== undefined) box.max = String(max);
  box.value = String(value);
  const range = slider ? element("input", { type: "range", min: String(min), max: String(max), step: String(step), "aria-label": label }) : null;
  if (range) range.value = String(value);
  const problem = element("p", { className: "problem", hidden: true, role: "alert" });
  box.addEventListener("input", () => {
    problem.hidden = box.validity.valid;
    problem.textContent = box.validity.valid ? "" : box.validationMessage;
    box.setAttribute("aria-invalid", String(!box.validity.valid));
    if (!box.validity.valid) return;
    if (range) range.value = box.value;
    changed(box.valueAsNumber);
  });
  range?.addEventListener("input", () => {
    box.value = range.value;
    box.dispatchEvent(new Event("input"));
  });
  const node = row(label, box, { help, unit }, ...(range ? [range] : []));
  node.append(problem);
  const set = (/** @type {number} */ next) => {
    const text = String(Number(next.toPrecision(5)));
    if (document.activeElement !== box) box.value = text;
    if (range) range.value = text;
  };
  return { node, control: box, set };
}

/** @param {string} text @param {() => void} pressed @param {string} [className] */
export function button(text, pressed, className = "") {
  const node = element("button", { type: "button", className }, text);
  node.addEventListener("click", pressed);
  return node;
}
