// @ts-check
// Where one mask gives way to the other: by the slider, or by a drag over the picture.

/** @param {import("./view.js").View} view @param {HTMLElement} frame @param {HTMLInputElement} slider 0 to 100 */
export function wire_wipe(view, frame, slider) {
  const wipe_to = (/** @type {number} */ share_of_width) => {
    view.wipe = Math.min(Math.max(share_of_width, 0), 1);
    slider.value = String(100 * view.wipe);
    frame.style.setProperty("--wipe", String(view.wipe));
    view.draw();
  };
  slider.addEventListener("input", () => wipe_to(slider.valueAsNumber / 100));
  const drag = (/** @type {PointerEvent} */ event) => {
    if (view.mode !== "wipe" || (event.type === "pointermove" && !frame.hasPointerCapture(event.pointerId))) return;
    frame.setPointerCapture(event.pointerId);
    const box = frame.getBoundingClientRect();
    wipe_to((event.clientX - box.left) / box.width);
  };
  frame.addEventListener("pointerdown", drag);
  frame.addEventListener("pointermove", drag);
}
