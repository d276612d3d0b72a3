// The drawing's outlines, for what is placed and drawn over the plan.

import { unpack } from "../viewer/js/columns.js";

/** @typedef {[number, number, number, number, number, number]} Affine  x' = a x + c y + e, y' = b x + d y + f */

export class Outline {
  /** @param {any} found the answer of `drawing` @param {Uint8Array} bytes its columns */
  constructor(found, bytes) {
    const { numbers } = unpack(bytes, found.columns);
    const column = (/** @type {string} */ name) => numbers.get(name) ?? new Float64Array(0);
    this.counts = column("count");
    this.x = column("x").map((micrometres) => micrometres / 1000);
    this.y = column("y").map((micrometres) => micrometres / 1000);
    /** The ink's bounding box in the drawing's frame. @type {[number, number, number, number] | null} */
    this.bounds = found.bounds_mm;
  }

  /** Lower-left and upper-right corner under a linear map. @param {number} a @param {number} b @param {number} c @param {number} d @returns {[number, number, number, number]} */
  box(a, b, c, d) {
    let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
    for (let k = 0; k < this.x.length; k++) {
      const x = a * this.x[k] + c * this.y[k];
      const y = b * this.x[k] + d * this.y[k];
      if (x < x0) x0 = x;
      if (x > x1) x1 = x;
      if (y < y0) y0 = y;
      if (y > y1) y1 = y;
    }
    return [x0, y0, x1, y1];
  }

  /** @param {Affine} map @returns {Path2D} */
  path([a, b, c, d, e, f]) {
    const path = new Path2D();
    let at = 0;
    for (const count of this.counts) {
      for (let k = 0; k < count; k++, at++) {
        const x = a * this.x[at] + c * this.y[at] + e;
        const y = b * this.x[at] + d * this.y[at] + f;
        if (k === 0) path.moveTo(x, y);
        else path.lineTo(x, y);
      }
    }
    return path;
  }
}
