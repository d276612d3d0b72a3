// The machine as geometry: from ticks to joints, and from joints to the points of its links.

/**
 * An affine function of the two joints.
 * @typedef {[number, number, number]} Affine  constant, factor of joint 0, factor of joint 1
 */
/**
 * A point of the machine: fixed, at a distance and direction from an earlier point, or where circles
 * about two earlier points cross.
 * @typedef {{x: number, y: number} | {from: number, length_mm: Affine, angle_rad: Affine}
 *   | {centers: [number, number], radii_mm: [Affine, Affine], is_left: boolean}} Anchor
 */
/**
 * @typedef {object} Part
 * @property {"rail" | "link" | "pivot"} kind
 * @property {number} from  index of a point
 * @property {number} to
 */
/**
 * @typedef {object} Machine
 * @property {string} name
 * @property {string} kind
 * @property {[number, number, number, number]} sheet_mm  x0, y0, x1, y1
 * @property {number[][]} reach_mm  closed outlines, x and y in turn
 * @property {[[number, number], [number, number]]} joints_per_tick
 * @property {[number, number]} offset_ticks
 * @property {{anchors: Anchor[], parts: Part[], pen: number}} linkage
 * @property {{name: string, kind: "revolute" | "prismatic"}[]} joints
 * @property {{name: string, speed: number, acceleration: number, jerk: number | null}[]} motors
 * @property {{speed_mm_s: number, travel_speed_mm_s: number | null, lift_s: number, drop_s: number}} pen
 */

/** @param {Affine} f @param {number} q0 @param {number} q1 */
function affine(f, q0, q1) {
  return f[0] + f[1] * q0 + f[2] * q1;
}

/**
 * A function from motor positions, ticks, to joints.
 * @param {Machine} machine @returns {(a: number, b: number) => [number, number]}
 */
export function joints(machine) {
  const [[m00, m01], [m10, m11]] = machine.joints_per_tick;
  const [o0, o1] = machine.offset_ticks;
  return (a, b) => {
    const [u, v] = [a - o0, b - o1];
    return [m00 * u + m01 * v, m10 * u + m11 * v];
  };
}

/**
 * The points of the machine at motor positions, machine mm: x and y in turn.
 * @param {Machine} machine @returns {(a: number, b: number) => Float64Array}
 */
export function pose(machine) {
  const toJoints = joints(machine);
  const anchors = machine.linkage.anchors;
  const points = new Float64Array(2 * anchors.length);
  return (a, b) => {
    const [q0, q1] = toJoints(a, b);
    anchors.forEach((anchor, k) => {
      if ("x" in anchor) {
        points[2 * k] = anchor.x;
        points[2 * k + 1] = anchor.y;
      } else if ("centers" in anchor) {
        const [first, second] = anchor.centers;
        const [r1, r2] = anchor.radii_mm.map((radius) => affine(radius, q0, q1));
        const [dx, dy] = [points[2 * second] - points[2 * first], points[2 * second + 1] - points[2 * first + 1]];
        const d = Math.hypot(dx, dy);
        const along = (r1 * r1 - r2 * r2 + d * d) / (2 * d);
        const across = Math.sqrt(Math.max(0, r1 * r1 - along * along)) * (anchor.is_left ? 1 : -1);
        points[2 * k] = points[2 * first] + (along * dx - across * dy) / d;
        points[2 * k + 1] = points[2 * first + 1] + (along * dy + across * dx) / d;
      } else {
        const length = affine(anchor.length_mm, q0, q1);
        const angle = affine(anchor.angle_rad, q0, q1);
        points[2 * k] = points[2 * anchor.from] + length * Math.cos(angle);
        points[2 * k + 1] = points[2 * anchor.from + 1] + length * Math.sin(angle);
      }
    });
    return points;
  };
}

/**
 * The pen at motor positions, machine mm, without allocation: rows are many. Returns a function that
 * writes x and y to `out`.
 * @param {Machine} machine @returns {(a: number, b: number, out: Float64Array) => void}
 */
export function pen(machine) {
  const [[m00, m01], [m10, m11]] = machine.joints_per_tick;
  const [o0, o1] = machine.offset_ticks;
  // The pen is a sum of vectors along its chain of anchors.
  let [x0, y0] = [0, 0];
  /** @type {{length: Affine, angle: Affine, turns: boolean, cos: number, sin: number}[]} */
  const links = [];
  for (let index = machine.linkage.pen; ;) {
    const anchor = machine.linkage.anchors[index];
    if ("x" in anchor) {
      [x0, y0] = [anchor.x, anchor.y];
      break;
    }
    if ("centers" in anchor) return closed(machine);
    const { length_mm: length, angle_rad: angle } = anchor;
    const turns = angle[1] !== 0 || angle[2] !== 0;
    links.push({ length, angle, turns, cos: Math.cos(angle[0]), sin: Math.sin(angle[0]) });
    index = anchor.from;
  }
  const count = links.length;
  return (a, b, out) => {
    const [u, v] = [a - o0, b - o1];
    const q0 = m00 * u + m01 * v;
    const q1 = m10 * u + m11 * v;
    let x = x0;
    let y = y0;
    for (let k = 0; k < count; k++) {
      const link = links[k];
      const length = affine(link.length, q0, q1);
      if (link.turns) {
        const angle = affine(link.angle, q0, q1);
        x += length * Math.cos(angle);
        y += length * Math.sin(angle);
      } else {
        x += length * link.cos;
        y += length * link.sin;
      }
    }
    out[0] = x;
    out[1] = y;
  };
}

/**
 * The pen of a mechanism with a closed chain: from all of its points.
 * @param {Machine} machine @returns {(a: number, b: number, out: Float64Array) => void}
 */
function closed(machine) {
  const at = pose(machine);
  const index = 2 * machine.linkage.pen;
  return (a, b, out) => {
    const points = at(a, b);
    out[0] = points[index];
    out[1] = points[index + 1];
  };
}
