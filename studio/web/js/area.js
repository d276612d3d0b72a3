// The area of a sketch pad: two opposite corners that the person presses, and what they are on the sheet.

/** Corners nearer than this to each other make no area, CSS pixels. */
export const LEAST_PX = 20;

/**
 * @typedef {object} Area
 * @property {number[]} pad  x and y of the first and of the opposite corner, CSS pixels of the picture
 * @property {number[]} sheet  the same on the sheet, mm from its lower-left corner
 */

/** Whether this is an area. @param {any} area @returns {boolean} */
export function isArea(area) {
  const isFour = (/** @type {any} */ four) => Array.isArray(four) && four.length === 4 && four.every(Number.isFinite);
  return isFour(area?.pad) && isFour(area?.sheet) && isLarge(area.pad);
}

/** Whether the corners are far enough apart in both directions. @param {number[]} pad */
export function isLarge([x0, y0, x1, y1]) {
  return Math.abs(x1 - x0) >= LEAST_PX && Math.abs(y1 - y0) >= LEAST_PX;
}

/** The sheet's corners for two pressed ones: a pad that lies as the sheet does. @param {number[]} pad @param {number} width mm @param {number} height mm */
export function corners([x0, y0, x1, y1], width, height) {
  const [left, bottom] = [x0 < x1, y0 > y1];
  return [left ? 0 : width, bottom ? 0 : height, left ? width : 0, bottom ? height : 0];
}

/**
 * A place of the pad on the sheet, mm; beyond the area it is on its edge.
 * @param {Area} area @param {number} x @param {number} y CSS pixels @returns {[number, number]}
 */
export function mapped({ pad, sheet }, x, y) {
  const share = (/** @type {number} */ value, /** @type {number} */ from, /** @type {number} */ to) => Math.min(Math.max((value - from) / (to - from), 0), 1);
  const [u, v] = [share(x, pad[0], pad[2]), share(y, pad[1], pad[3])];
  return [sheet[0] + u * (sheet[2] - sheet[0]), sheet[1] + v * (sheet[3] - sheet[1])];
}
