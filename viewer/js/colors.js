// Colours of ink. Scales are readable for colour-blind people: viridis (van der Walt and Smith,
// 2015) for quantities, Okabe and Ito's colours for kinds.

/** Viridis at 0, 1/8, ... 1: dark blue to yellow. Its yellow end is cut, as it is weak on paper. */
const VIRIDIS = [
  [68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141],
  [39, 173, 129], [92, 200, 99], [156, 212, 50], [214, 206, 30],
];

/** Levels of a scale: ink of one level is drawn at once. */
export const LEVELS = 24;

/** @param {number} share 0 to 1 */
export function viridis(share) {
  const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
  const index = Math.min(Math.floor(place), VIRIDIS.length - 2);
  const mixed = VIRIDIS[index].map((low, k) => Math.round(low + (place - index) * (VIRIDIS[index + 1][k] - low)));
  return `rgb(${mixed.join(" ")})`;
}

/** The colours of a scale's levels. @type {string[]} */
export const SCALE = Array.from({ length: LEVELS }, (_, level) => viridis(level / (LEVELS - 1)));

/** Colours of kinds; the first is for none of them. */
export const KINDS = ["#7f7f7f", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#882255"];

/** A theme's colours, read from the style sheet. @returns {Record<string, string>} */
export function theme() {
  const style = getComputedStyle(document.documentElement);
  const names = ["desk", "paper", "paper-line", "reach", "reach-line", "ahead", "travel", "machine",
    "machine-fill", "ghost", "reference", "select", "head", "motor-a", "motor-b", "pen-line", "limit", "grid",
    "soft", "text", "panel", "line", "accent"];
  return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}
