// Smooth curves along hand-drawn points: cubic Béziers that stay within a tolerance of all points
// (P. J. Schneider, "An algorithm for automatically fitting digitized curves", Graphics Gems, 1990).

/** @typedef {[number, number]} Point @typedef {[Point, Point, Point, Point]} Cubic */

/** Improvements of the parameters before a curve is split. */
const ROUNDS = 4;

const minus = (/** @type {Point} */ a, /** @type {Point} */ b) => /** @type {Point} */ ([a[0] - b[0], a[1] - b[1]]);
const plus = (/** @type {Point} */ a, /** @type {Point} */ b, scale = 1) => /** @type {Point} */ ([a[0] + scale * b[0], a[1] + scale * b[1]]);
const dot = (/** @type {Point} */ a, /** @type {Point} */ b) => a[0] * b[0] + a[1] * b[1];
const size = (/** @type {Point} */ a) => Math.hypot(a[0], a[1]);
const unit = (/** @type {Point} */ a) => {
  const length = size(a);
  return /** @type {Point} */ (length > 0 ? [a[0] / length, a[1] / length] : [1, 0]);
};

/** The point of a cubic at a parameter. @param {Cubic} c @param {number} t @returns {Point} */
export function at(c, t) {
  const u = 1 - t;
  const weights = [u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t];
  return /** @type {Point} */ ([0, 1].map((k) => weights.reduce((sum, weight, j) => sum + weight * c[j][k], 0)));
}

/** Points at least `least` apart; the last one is kept. @param {Point[]} points @param {number} least @returns {Point[]} */
function thinned(points, least) {
  const kept = [points[0]];
  for (const point of points.slice(1)) {
    if (size(minus(point, kept[kept.length - 1])) >= least) kept.push(point);
  }
  const last = points[points.length - 1];
  if (kept.length > 1 && kept[kept.length - 1] !== last) kept[kept.length - 1] = last;
  return kept;
}

/**
 * Curves within `tolerance` of the points, from the first to the last; none for less than two points.
 * @param {Point[]} points @param {number} tolerance mm @returns {Cubic[]}
 */
export function smooth(points, tolerance) {
  const kept = thinned(points, Math.max(tolerance / 4, 0.02));
  if (kept.length < 2) return [];
  const curves = /** @type {Cubic[]} */ ([]);
  const last = kept.length - 1;
  fit(kept, 0, last, tangent(kept, 0, 1, tolerance), tangent(kept, last, -1, tolerance), tolerance, curves);
  return curves;
}

/** The direction at a point towards those that come in the order of `step`, over about the tolerance. @param {Point[]} points @param {number} from @param {number} step @param {number} tolerance */
function tangent(points, from, step, tolerance) {
  let k = from + step;
  while (points[k + step] && size(minus(points[k], points[from])) < 2 * tolerance) k += step;
  return unit(minus(points[k], points[from]));
}

/** @param {Point[]} points @param {number} first @param {number} last @param {Point} start @param {Point} end @param {number} tolerance @param {Cubic[]} curves */
function fit(points, first, last, start, end, tolerance, curves) {
  const [a, b] = [points[first], points[last]];
  if (last - first === 1) {
    const third = size(minus(b, a)) / 3;
    curves.push([a, plus(a, start, third), plus(b, end, third), b]);
    return;
  }
  let parameters = chords(points, first, last);
  let worst = { distance: Infinity, index: (first + last) >> 1 };
  for (let round = 0; round <= ROUNDS; round++) {
    const curve = solved(points, first, parameters, start, end);
    worst = farthest(points, first, last, curve, parameters);
    if (worst.distance <= tolerance) {
      curves.push(curve);
      return;
    }
    parameters = parameters.map((t, k) => improved(curve, points[first + k], t));
  }
  const middle = Math.min(Math.max(worst.index, first + 1), last - 1);
  const across = unit(minus(points[Math.max(middle - 2, first)], points[Math.min(middle + 2, last)]));
  fit(points, first, middle, start, across, tolerance, curves);
  fit(points, middle, last, [-across[0], -across[1]], end, tolerance, curves);
}

/** Parameters by the length along the points. @param {Point[]} points @param {number} first @param {number} last */
function chords(points, first, last) {
  const sums = [0];
  for (let k = first + 1; k <= last; k++) sums.push(sums[sums.length - 1] + size(minus(points[k], points[k - 1])));
  return sums.map((sum) => sum / sums[sums.length - 1]);
}

/** The cubic with these end directions that is nearest to the points. @param {Point[]} points @param {number} first @param {number[]} parameters @param {Point} start @param {Point} end @returns {Cubic} */
function solved(points, first, parameters, start, end) {
  const [a, b] = [points[first], points[first + parameters.length - 1]];
  let [c00, c01, c11, x0, x1] = [0, 0, 0, 0, 0];
  parameters.forEach((t, k) => {
    const u = 1 - t;
    const [b0, b1, b2, b3] = [u * u * u, 3 * u * u * t, 3 * u * t * t, t * t * t];
    const [left, right] = [/** @type {Point} */ ([start[0] * b1, start[1] * b1]), /** @type {Point} */ ([end[0] * b2, end[1] * b2])];
    c00 += dot(left, left);
    c01 += dot(left, right);
    c11 += dot(right, right);
    const rest = minus(points[first + k], /** @type {Point} */ ([a[0] * (b0 + b1) + b[0] * (b2 + b3), a[1] * (b0 + b1) + b[1] * (b2 + b3)]));
    x0 += dot(left, rest);
    x1 += dot(right, rest);
  });
  const determinant = c00 * c11 - c01 * c01;
  const span = size(minus(b, a));
  let alpha = determinant !== 0 ? (x0 * c11 - x1 * c01) / determinant : 0;
  let beta = determinant !== 0 ? (c00 * x1 - c01 * x0) / determinant : 0;
  // Handles that point backwards or far away would make loops.
  if (!(alpha > 1e-6 * span) || !(beta > 1e-6 * span) || alpha > 3 * span || beta > 3 * span) alpha = beta = span / 3;
  return [a, plus(a, start, alpha), plus(b, end, beta), b];
}

/** @param {Point[]} points @param {number} first @param {number} last @param {Cubic} curve @param {number[]} parameters */
function farthest(points, first, last, curve, parameters) {
  const worst = { distance: 0, index: first };
  for (let k = first + 1; k < last; k++) {
    const distance = size(minus(at(curve, parameters[k - first]), points[k]));
    if (distance > worst.distance) Object.assign(worst, { distance, index: k });
  }
  return worst;
}

/** A step of Newton's method towards the parameter of the nearest point. @param {Cubic} c @param {Point} point @param {number} t */
function improved(c, point, t) {
  const first = [0, 1, 2].map((k) => /** @type {Point} */ (minus(c[k + 1], c[k]).map((x) => 3 * x)));
  const second = [0, 1].map((k) => /** @type {Point} */ (minus(first[k + 1], first[k]).map((x) => 2 * x)));
  const u = 1 - t;
  const rate = /** @type {Point} */ ([0, 1].map((k) => u * u * first[0][k] + 2 * u * t * first[1][k] + t * t * first[2][k]));
  const bend = /** @type {Point} */ ([0, 1].map((k) => u * second[0][k] + t * second[1][k]));
  const off = minus(at(c, t), point);
  const slope = dot(rate, rate) + dot(off, bend);
  return slope === 0 ? t : Math.min(Math.max(t - dot(off, rate) / slope, 0), 1);
}
