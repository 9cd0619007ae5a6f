// @ts-check
// The choice between the mask and the picture under its light, and what is to be said of the picture.

/** @typedef {import("./view.js").View} View */
/** @typedef {import("./picture.js").Picture} Picture */

const by_id = (/** @type {string} */ id) => /** @type {any} */ (document.getElementById(id));

/** Takes a picture, and shows it; null: there is none. @param {View} view @param {Picture | null} picture */
export function choose_picture(view, picture) {
  view.picture = picture;
  view.shows = picture ? "picture" : "mask";
  /** @type {any} */ (document.querySelector(`[name=shows][value=${view.shows}]`)).checked = true;
}

/** Says what is seen. @param {View} view */
export function show_picture_choice(view) {
  const { picture, a } = view;
  const fits = picture !== null && a !== null && picture.fits(a);
  by_id("shows").hidden = picture === null;
  by_id("shows").disabled = !fits;
  const note = by_id("picture_note");
  note.hidden = picture === null || a === null || (fits && !view.shows_picture);
  note.classList.toggle("problem", !fits);
  const said = picture && a ? picture.said_of(a) : "";
  // Set once: it is read out.
  if (note.textContent !== said) note.textContent = said;
  by_id("tone_label").hidden = view.shows_picture;
  const label = view.shows_picture ? `${picture?.name} under this light alone` : "The mask: visibility of the light, white fully lit, black umbra";
  by_id("mask").setAttribute("aria-label", label);
}
