// A plan in memory: rows, strokes, motion against limits.

import { pen as penOf } from "./machine.js";

/**
 * @typedef {object} Limit  something that can limit the speed
 * @property {string} name
 * @property {(row: number) => number} share  of the limit used after this row, 0 to 1
 */

/** The row at or before a time. @param {Float64Array} times @param {number} t */
export function rowAt(times, t) {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}

/**
 * A motion: positions of two motors against time, and the pen.
 * @typedef {object} Track
 * @property {Float64Array} t  s
 * @property {Uint16Array} pen  from each row to the next; 0 is up
 * @property {[Float64Array, Float64Array]} q  motors, ticks
 * @property {[Float64Array, Float64Array] | null} lag  where the mechanism is against the motors, ticks; null
 *   without backlash
 * @property {[Float64Array, Float64Array] | null} off  as in `track`
 * @property {Float32Array} x  the pen over the paper, machine mm
 * @property {Float32Array} y
 * @property {Int32Array} first  the first row of each stroke
 * @property {Int32Array} last  its last row: ink ends here
 */

/**
 * @param {Float64Array} t @param {Float64Array} pens @param {[Float64Array, Float64Array]} q
 * @param {(a: number, b: number, out: Float64Array) => void} position  of the pen
 * @param {[Float64Array, Float64Array] | null} off  of a machine that moves in whole ticks: how far those
 *   are from the nearest ones; empty where they are those
 * @param {[number, number]} play  backlash of the motors, ticks
 * @returns {Track}
 */
export function track(t, pens, q, position, off, play) {
  const count = t.length;
  const loads = new Float64Array(2);
  /** @type {[Float64Array, Float64Array] | null} */
  const lag = play[0] > 0 || play[1] > 0 ? [new Float64Array(count), new Float64Array(count)] : null;
  /** The mechanism follows a motor that has taken up its play. @param {0 | 1} k @param {number} row @param {number} motor */
  const load = (k, row, motor) => {
    if (!lag) return motor;
    const half = 0.5 * play[k];
    loads[k] = row === 0 ? motor : Math.min(Math.max(loads[k], motor - half), motor + half);
    lag[k][row] = loads[k] - motor;
    return loads[k];
  };
  const x = new Float32Array(count);
  const y = new Float32Array(count);
  const pen = Uint16Array.from(pens);
  const first = [];
  const last = [];
  const at = new Float64Array(2);
  for (let row = 0; row < count; row++) {
    const a = q[0][row];
    const b = q[1][row];
    const whole = (/** @type {0 | 1} */ k, /** @type {number} */ exact) =>
      off ? Math.floor(exact + 0.5) + (off[k][row] ?? 0) : exact;
    position(load(0, row, whole(0, a)), load(1, row, whole(1, b)), at);
    x[row] = at[0];
    y[row] = at[1];
    const before = row > 0 ? pen[row - 1] : 0;
    if (pen[row] !== before) {
      if (before !== 0) last.push(row);
      if (pen[row] !== 0) first.push(row);
    }
  }
  if (last.length < first.length) last.push(count - 1);
  return { t, pen, q, off, lag, x, y, first: Int32Array.from(first), last: Int32Array.from(last) };
}

/**
 * Where the mechanism is at a time, in the motors' ticks: a machine that moves in whole ticks stands on those of
 * its rows, so that its pen is on the ink.
 * @param {Track} of @param {number} t @returns {[number, number]}
 */
export function motorsAt(of, t) {
  const row = rowAt(of.t, t);
  const next = Math.min(row + 1, of.t.length - 1);
  const span = of.t[next] - of.t[row];
  const share = span > 0 ? Math.min(Math.max((t - of.t[row]) / span, 0), 1) : 0;
  const { q, off, lag } = of;
  const load = (/** @type {0 | 1} */ k, /** @type {number} */ index) =>
    (off ? Math.floor(q[k][index] + 0.5) + (off[k][index] ?? 0) : q[k][index]) + (lag?.[k][index] ?? 0);
  const at = (/** @type {0 | 1} */ k) => load(k, row) + share * (load(k, next) - load(k, row));
  return [at(0), at(1)];
}

/** The stroke that is drawn at a row, or the last one before it; -1 before all. @param {Track} of @param {number} row */
export function strokeAt(of, row) {
  let low = -1;
  let high = of.first.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (of.first[middle] <= row) low = middle;
    else high = middle - 1;
  }
  return low;
}

/**
 * Speeds and what limits them, row by row: a value holds from its row to the next.
 * @typedef {object} Motion
 * @property {Float32Array[]} speed  of each motor, share of its limit, signed
 * @property {Float32Array[]} acceleration
 * @property {(Float32Array | null)[]} jerk  where the machine limits it
 * @property {Float32Array} pen  speed of the pen over the paper, mm/s
 * @property {number} averaged_s  over which time speeds are averaged; 0 for exact positions
 */

/**
 * Whole ticks alone do not tell the acceleration from its rounding: positions that are not exact
 * are compared over so many rows that the rounding is small against the limit.
 * @param {any} meta @param {Track} rows @returns {Motion}
 */
export function motion(meta, rows) {
  const count = rows.t.length;
  const period = meta.period_us * 1e-6;
  const motors = meta.machine.motors;
  const position = penOf(meta.machine);
  let stride = 1;
  if (!meta.exact) {
    const least = Math.min(...motors.map((/** @type {any} */ motor) => motor.acceleration));
    stride = Math.min(Math.max(Math.ceil(Math.sqrt(20 / least) / period), 1), 50);
  }
  const inverse = 1 / (stride * period);
  // Rows are a period apart but for rests, at whose ends the motors do not move.
  const { q, lag } = rows;
  /** @type {[Float64Array, Float64Array]} */
  const loads = lag ? [q[0].map((a, row) => a + lag[0][row]), q[1].map((b, row) => b + lag[1][row])] : q;
  const result = {
    speed: motors.map(() => new Float32Array(count)),
    acceleration: motors.map(() => new Float32Array(count)),
    jerk: motors.map((/** @type {any} */ motor) => (motor.jerk ? new Float32Array(count) : null)),
    pen: new Float32Array(count),
    averaged_s: stride > 1 ? stride * period : 0,
  };
  // The first row after a rest and the last one before the next: differences stay between them.
  let start = 0;
  for (let end = 1; end <= count; end++) {
    const isRest = end === count || rows.t[end] - rows.t[end - 1] > 1.5 * period;
    if (!isRest) continue;
    for (let k = 0; k < motors.length; k++) {
      motorMotion(q[k], start, end, stride, inverse, motors[k], result.speed[k], result.acceleration[k], result.jerk[k]);
    }
    penMotion(loads, start, end, stride, inverse, position, result.pen);
    start = end;
  }
  return result;
}

/**
 * One motor between two rests, rows `start` to before `end`.
 * @param {Float64Array} q @param {number} start @param {number} end @param {number} stride @param {number} inverse
 * @param {any} motor @param {Float32Array} speed @param {Float32Array} acceleration @param {Float32Array | null} jerk
 */
function motorMotion(q, start, end, stride, inverse, motor, speed, acceleration, jerk) {
  const half = stride >> 1;
  const last = end - 1;
  const [perSpeed, perAcceleration] = [inverse / motor.speed, inverse ** 2 / motor.acceleration];
  for (let row = start; row < last; row++) {
    const here = q[Math.max(row - half, start)];
    const after = q[Math.min(row - half + stride, last)];
    const before = q[Math.max(row - half - stride, start)];
    speed[row] = (after - here) * perSpeed;
    acceleration[row] = (after - 2 * here + before) * perAcceleration;
    if (jerk) {
      const more = q[Math.max(row - half - 2 * stride, start)];
      jerk[row] = ((after - 3 * here + 3 * before - more) * inverse ** 3) / motor.jerk;
    }
  }
}

/**
 * The pen between two rests.
 * @param {[Float64Array, Float64Array]} q @param {number} start @param {number} end @param {number} stride @param {number} inverse
 * @param {(a: number, b: number, out: Float64Array) => void} position @param {Float32Array} pen
 */
function penMotion(q, start, end, stride, inverse, position, pen) {
  const half = stride >> 1;
  const last = end - 1;
  const [one, two] = [new Float64Array(2), new Float64Array(2)];
  let known = -1;
  for (let row = start; row < last; row++) {
    const from = Math.max(row - half, start);
    const to = Math.min(row - half + stride, last);
    // With neighbouring rows the last position is this one's first.
    if (known === from) one.set(two);
    else position(q[0][from], q[1][from], one);
    position(q[0][to], q[1][to], two);
    known = to;
    pen[row] = Math.hypot(two[0] - one[0], two[1] - one[1]) * inverse;
  }
}

/**
 * What can limit the pen, with its share at every row.
 * @param {any} meta @param {Track} rows @param {Motion} moving @returns {Limit[]}
 */
export function limits(meta, rows, moving) {
  const speeds = new Map(meta.pens.map((/** @type {any} */ pen) => [pen.number, pen.speed_mm_s]));
  /** @type {Limit[]} */
  const all = [{
    name: "the pen's speed",
    share: (row) => moving.pen[row] / (speeds.get(rows.pen[row]) ?? meta.machine.pen.speed_mm_s),
  }];
  meta.machine.motors.forEach((/** @type {any} */ motor, /** @type {number} */ k) => {
    all.push({ name: `speed of ${motor.name}`, share: (row) => Math.abs(moving.speed[k][row]) });
    all.push({ name: `acceleration of ${motor.name}`, share: (row) => Math.abs(moving.acceleration[k][row]) });
    const jerk = moving.jerk[k];
    if (jerk) all.push({ name: `jerk of ${motor.name}`, share: (row) => Math.abs(jerk[row]) });
  });
  return all;
}

/** A limit binds from this share on. */
const BINDS = 0.95;

/** Index of the limit that binds at a row, from 1; 0 if none does. @param {Limit[]} all @param {number} row */
export function binding(all, row) {
  let best = 0;
  let most = BINDS;
  all.forEach((limit, index) => {
    const share = limit.share(row);
    if (share >= most) {
      most = share;
      best = index + 1;
    }
  });
  return best;
}

/** Length of a stroke, mm. @param {Track} rows @param {number} stroke */
export function inkLength(rows, stroke) {
  let sum = 0;
  for (let row = rows.first[stroke]; row < rows.last[stroke]; row++) {
    sum += Math.hypot(rows.x[row + 1] - rows.x[row], rows.y[row + 1] - rows.y[row]);
  }
  return sum;
}
