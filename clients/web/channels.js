// @ts-check
// The channels and parts of an image that may be depth, from what the service says when it is not certain which one is.

/** @typedef {{channel: string, part?: number}} Channel */

/** One part's list, or the only one: `part 1 "view": R, G, Z`. */
const PART = /^part (\d+)(?: "[^"]*")?: (.*)$/s;

/** Those that an error lists, in its order; none where it is about something else.
 * @param {string} detail @returns {Channel[]} */
export function channels_in(detail) {
  const said = /(?:no channel that is depth for certain|more than one depth|has no channel "[^"]*"|has no part [^;]*).*?; it has (.*?)(?: and \d+ more)?(?: \((?:name|choose|parts)[^()]*\))?$/s.exec(detail);
  if (!said) return [];
  return said[1].split("; ").flatMap((piece) => {
    const of_part = PART.exec(piece);
    const names = (of_part ? of_part[2] : piece).split(", ");
    return names.filter((name) => name !== "").map((channel) => (of_part ? { channel, part: Number(of_part[1]) } : { channel }));
  });
}

/** @param {Channel} one */
export const channel_label = ({ channel, part }) => (part === undefined ? channel : `${channel} (part ${part})`);
