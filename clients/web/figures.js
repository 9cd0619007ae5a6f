// @ts-check
// Tables of stage times and error figures.
import { element } from "./fields.js";

/** @typedef {import("./client.js").Stage} Stage */
/** @typedef {import("./metrics.js").Metrics} Metrics */

const ms = (/** @type {number} */ value) => (value < 10 ? value.toFixed(2) : value.toFixed(1));

/** Stage times as bars. @param {string} title @param {Stage[]} stages @param {number} round_trip ms */
export function stage_table(title, stages, round_trip) {
  const longest = Math.max(...stages.map((stage) => stage.ms), 1e-9);
  const rows = stages.map((stage) => {
    const bar = element("span", { className: "bar_fill" });
    bar.style.setProperty("--share", String(stage.ms / longest));
    return element("tr", {}, element("th", { scope: "row" }, stage.name.replaceAll("-", " ")), element("td", {}, ms(stage.ms)), element("td", { className: "bar_cell", ariaHidden: "true" }, bar));
  });
  const sum = stages.reduce((total, stage) => total + stage.ms, 0);
  const last = (/** @type {string} */ name, /** @type {number} */ value) =>
    element("tr", { className: "total" }, element("th", { scope: "row" }, name), element("td", {}, ms(value)), element("td", {}));
  return element("table", { className: "stages" },
    element("caption", {}, title, element("span", { className: "help" }, " ms")),
    element("tbody", {}, ...rows, last("all stages", sum), last("there and back", round_trip)));
}

/** @param {Metrics} metrics @param {string} a @param {string} b */
export function error_table(metrics, a, b) {
  const percent = metrics.pixels > 0 ? (100 * metrics.pixels_shadow) / metrics.pixels : 0;
  /** @type {[string, number, string][]} */
  const figures = [
    ["MAE", metrics.mae_shadow, "mean absolute difference, over shadow pixels"],
    ["RMSE", metrics.rmse_shadow, "root of the mean square, over shadow pixels"],
    ["Bias", metrics.bias_shadow, "mean difference, over shadow pixels; below 0: darker"],
    ["99 %", metrics.p99_shadow, "99th percentile of the absolute difference, over shadow pixels"],
    ["Max", metrics.max, "largest difference, over all pixels"],
  ];
  return element("div", {},
    element("h3", {}, `${a} against ${b}`),
    element("dl", { className: "figures" }, ...figures.map(([name, value, title]) =>
      element("div", { title }, element("dt", {}, name), element("dd", {}, value.toFixed(4))))),
    element("p", { className: "help" }, `Visibility, 0 to 1. ${metrics.pixels_shadow} of ${metrics.pixels} pixels (${percent.toFixed(1)} %) are below 0.999 in either.`));
}
