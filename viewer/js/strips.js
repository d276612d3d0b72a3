// Diagrams of the motors' motion against time, drawn by uPlot. A strip gets at most two points a
// pixel: minimum and maximum of its rows, from a pyramid of minima and maxima.

import { rowAt } from "./plan.js";
import { theme } from "./colors.js";
import { percent, short } from "./format.js";

/** Rows of one level that become one of the next. */
const FOLD = 16;
/** Height of a strip's plot, CSS pixels. */
const HEIGHT = 80;
/** From this share of a limit on, a strip is marked. */
const MARKED = 0.95;

/** Minima and maxima of a series over any range of rows. */
export class Pyramid {
  /** @param {ArrayLike<number>} values */
  constructor(values) {
    this.values = values;
    /** @type {[Float64Array, Float64Array][]} */
    this.levels = [];
    let [lows, highs] = [values, values];
    while (lows.length > FOLD) {
      const length = Math.ceil(lows.length / FOLD);
      const level = [new Float64Array(length).fill(Infinity), new Float64Array(length).fill(-Infinity)];
      for (let k = 0; k < lows.length; k++) {
        const at = Math.floor(k / FOLD);
        if (lows[k] < level[0][at]) level[0][at] = lows[k];
        if (highs[k] > level[1][at]) level[1][at] = highs[k];
      }
      this.levels.push(/** @type {[Float64Array, Float64Array]} */ (level));
      [lows, highs] = level;
    }
  }

  /** Minimum and maximum of rows `from` to before `to`. @param {number} from @param {number} to @returns {[number, number]} */
  range(from, to) {
    let [low, high] = [Infinity, -Infinity];
    const add = (/** @type {ArrayLike<number>} */ lows, /** @type {ArrayLike<number>} */ highs, /** @type {number} */ k) => {
      if (lows[k] < low) low = lows[k];
      if (highs[k] > high) high = highs[k];
    };
    /** @type {[ArrayLike<number>, ArrayLike<number>]} */
    let level = [this.values, this.values];
    for (let depth = 0; from < to; depth++) {
      const isTop = depth >= this.levels.length;
      while (from < to && (isTop || from % FOLD !== 0)) add(...level, from++);
      while (from < to && to % FOLD !== 0) add(...level, --to);
      if (from >= to) break;
      from /= FOLD;
      to /= FOLD;
      level = this.levels[depth];
    }
    return [low, high];
  }
}

/**
 * @typedef {object} Series
 * @property {string} name
 * @property {ArrayLike<number>} values
 * @property {string} color  name of a theme colour
 * @property {(value: number) => string} text  a value with its unit
 * @typedef {object} Strip
 * @property {string} title
 * @property {string} unit  of the axis
 * @property {Series[]} series
 * @property {number[]} limits  where limits are drawn
 * @property {number} [full]  the value that counts as the whole limit, to mark what comes near it
 * @property {boolean} [stepped]
 */

export class Strips {
  /**
   * @param {HTMLElement} parent @param {Float64Array} times @param {Strip[]} strips
   * @param {{seek: (t: number) => void, hover: (t: number | null) => void, windowChanged: (t0: number, t1: number) => void}} on
   */
  constructor(parent, times, strips, on) {
    this.parent = parent;
    this.times = times;
    this.on = on;
    this.end = times[times.length - 1];
    this.window = [0, this.end];
    this.head = 0;
    this.width = 0;
    this.strips = strips.map((strip) => this.make(strip));
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(parent);
  }

  /** Takes the diagrams out of the page. */
  remove() {
    this.observer.disconnect();
    for (const made of this.strips) made.chart?.destroy();
    this.parent.replaceChildren();
  }

  /** @param {Strip} strip */
  make(strip) {
    const box = document.createElement("div");
    box.className = "strip";
    const caption = document.createElement("p");
    caption.className = "caption";
    const title = document.createElement("b");
    title.textContent = `${strip.title}, ${strip.unit}`;
    caption.append(title);
    const marks = strip.series.map((series) => {
      const mark = document.createElement("span");
      mark.className = series.color === "motor-a" ? "a" : series.color === "motor-b" ? "b" : "p";
      mark.textContent = series.name;
      caption.append(mark);
      return mark;
    });
    const plot = document.createElement("div");
    plot.className = "plot";
    const line = document.createElement("div");
    line.className = "line";
    box.append(caption, plot);
    this.parent.append(box);
    const pyramids = strip.series.map((series) => new Pyramid(series.values));
    const made = { strip, box, plot, line, marks, pyramids, chart: /** @type {uPlot | null} */ (null), near: /** @type {[number, number][]} */ ([]) };
    this.build(made);
    return made;
  }

  /** @param {ReturnType<Strips["make"]>} made */
  build(made) {
    made.chart?.destroy();
    const colors = theme();
    const { strip } = made;
    const width = Math.max(this.parent.clientWidth, 100);
    const axis = { stroke: colors.soft, grid: { stroke: colors.grid, width: 1 }, ticks: { stroke: colors.grid, width: 1 }, font: "11px system-ui, sans-serif" };
    const ends = made.pyramids.map((pyramid) => pyramid.range(0, this.times.length));
    let low = Math.min(...ends.map((end) => end[0]), ...strip.limits);
    let high = Math.max(...ends.map((end) => end[1]), ...strip.limits);
    const margin = 0.08 * (high - low || 1);
    [low, high] = [low - margin, high + margin];
    const chart = new uPlot({
      width,
      height: HEIGHT,
      padding: [6, 14, 0, 0],
      legend: { show: false },
      cursor: { sync: { key: "time", setSeries: false }, drag: { setScale: false, x: false, y: false }, points: { size: 6 } },
      scales: { x: { time: false, range: () => /** @type {[number, number]} */ ([this.window[0], this.window[1]]) }, y: { range: () => /** @type {[number, number]} */ ([low, high]) } },
      axes: [
        { ...axis, size: 21, gap: 0, values: (_, splits) => splits.map((split) => `${Number(split.toFixed(6))} s`), space: 80 },
        { ...axis, size: 56, gap: 3, space: 22, values: (_, splits) => splits.map(short) },
      ],
      series: [{}, ...strip.series.map((series) => ({
        stroke: colors[series.color],
        width: 1.25,
        points: { show: false },
        paths: strip.stepped && uPlot.paths.stepped ? uPlot.paths.stepped({ align: 1 }) : undefined,
      }))],
      hooks: {
        drawClear: [(u) => this.drawNear(u, made.near, colors.limit)],
        draw: [(u) => drawLimits(u, strip.limits, colors.limit)],
        setCursor: [(u) => this.hovered(u, made)],
      },
    }, this.data(made, width), made.plot);
    made.chart = chart;
    chart.root.querySelector("canvas")?.setAttribute("aria-hidden", "true");
    chart.over.append(made.line);
    this.listen(chart);
    this.place(made);
  }

  /**
   * The data of the present window: rows, or minima and maxima where there are too many.
   * @param {any} made @param {number} width @returns {any}
   */
  data(made, width) {
    const [t0, t1] = this.window;
    const first = rowAt(this.times, t0);
    const last = Math.min(rowAt(this.times, t1) + 2, this.times.length);
    const series = made.strip.series;
    const full = made.strip.full;
    made.near = [];
    if (last - first <= 2 * width) {
      const rows = Array.from({ length: last - first }, (_, k) => first + k);
      if (full) {
        for (const row of rows.slice(0, -1)) {
          if (!series.some((/** @type {Series} */ one) => Math.abs(one.values[row]) >= MARKED * full)) continue;
          const before = made.near[made.near.length - 1];
          if (before && before[1] === this.times[row]) before[1] = this.times[row + 1];
          else made.near.push([this.times[row], this.times[row + 1]]);
        }
      }
      return [rows.map((row) => this.times[row]), ...series.map((/** @type {Series} */ one) => rows.map((row) => one.values[row]))];
    }
    const buckets = Math.max(Math.floor(width / 1.5), 50);
    /** @type {number[]} */
    const times = [];
    /** @type {number[][]} */
    const values = series.map(() => []);
    let from = first;
    for (let k = 0; k < buckets; k++) {
      const end = t0 + ((k + 1) / buckets) * (t1 - t0);
      const to = k === buckets - 1 ? last : Math.max(rowAt(this.times, end) + 1, from);
      const [start, width_s] = [t0 + (k / buckets) * (t1 - t0), (t1 - t0) / buckets];
      if (to <= from) {
        // A rest: the value of the row before it.
        times.push(start + 0.5 * width_s);
        series.forEach((/** @type {Series} */ one, /** @type {number} */ s) => values[s].push(one.values[Math.max(from - 1, 0)]));
        continue;
      }
      times.push(start + 0.25 * width_s, start + 0.75 * width_s);
      let isNear = false;
      made.pyramids.forEach((/** @type {Pyramid} */ pyramid, /** @type {number} */ s) => {
        const [low, high] = pyramid.range(from, to);
        values[s].push(low, high);
        isNear ||= full !== undefined && Math.max(Math.abs(low), Math.abs(high)) >= MARKED * full;
      });
      if (isNear) {
        const before = made.near[made.near.length - 1];
        if (before && start - before[1] < 1e-9) before[1] = start + width_s;
        else made.near.push([start, start + width_s]);
      }
      from = to;
    }
    return [times, ...values];
  }

  /** A band at the top where a limit is nearly used up. @param {uPlot} u @param {[number, number][]} near @param {string} color */
  drawNear(u, near, color) {
    const { ctx } = u;
    ctx.save();
    ctx.fillStyle = color;
    const { top, height } = u.bbox;
    for (const [from, to] of near) {
      const [left, right] = [u.valToPos(from, "x", true), u.valToPos(to, "x", true)];
      const width = Math.max(right - left, 1);
      ctx.globalAlpha = 0.12;
      ctx.fillRect(left, top, width, height);
      ctx.globalAlpha = 0.9;
      ctx.fillRect(left, top, width, 3 * devicePixelRatio);
    }
    ctx.restore();
  }

  /** @param {uPlot} u @param {any} made */
  hovered(u, made) {
    const left = u.cursor.left;
    if (left === undefined || left === null || left < 0) {
      if (made === this.strips?.[0]) this.on.hover(null);
      made.marks.forEach((/** @type {HTMLElement} */ mark, /** @type {number} */ s) => (mark.textContent = made.strip.series[s].name));
      return;
    }
    const t = u.posToVal(left, "x");
    if (made === this.strips?.[0]) this.on.hover(t);
    this.label(made, rowAt(this.times, t));
  }

  /** Names with the values at a row. @param {any} made @param {number} row */
  label(made, row) {
    made.marks.forEach((/** @type {HTMLElement} */ mark, /** @type {number} */ s) => {
      const series = made.strip.series[s];
      mark.textContent = `${series.name} ${series.text(series.values[row])}`;
    });
  }

  /** Wheel zooms in time, a drag moves, a click seeks. @param {uPlot} chart */
  listen(chart) {
    const over = chart.over;
    over.addEventListener("wheel", (event) => {
      if (event.shiftKey || !(event.ctrlKey || event.altKey || Math.abs(event.deltaY) > 0)) return;
      event.preventDefault();
      const at = chart.posToVal(event.clientX - over.getBoundingClientRect().left, "x");
      this.zoom(Math.exp(event.deltaY * 0.0015), at);
    }, { passive: false });
    let from = /** @type {{x: number, window: number[], moved: boolean} | null} */ (null);
    over.addEventListener("pointerdown", (event) => {
      from = { x: event.clientX, window: [...this.window], moved: false };
      over.setPointerCapture(event.pointerId);
    });
    over.addEventListener("pointermove", (event) => {
      if (!from) return;
      const dx = event.clientX - from.x;
      if (Math.abs(dx) > 3) from.moved = true;
      if (!from.moved) return;
      const shift = (-dx / over.clientWidth) * (from.window[1] - from.window[0]);
      this.show(from.window[0] + shift, from.window[1] + shift);
    });
    over.addEventListener("pointerup", (event) => {
      if (from && !from.moved) this.on.seek(chart.posToVal(event.clientX - over.getBoundingClientRect().left, "x"));
      from = null;
    });
    over.addEventListener("dblclick", () => this.show(0, this.end));
  }

  /** @param {number} factor @param {number} at the time that stays */
  zoom(factor, at) {
    const [t0, t1] = this.window;
    const span = Math.min(Math.max((t1 - t0) * factor, 0.05), this.end);
    const share = (at - t0) / (t1 - t0);
    this.show(at - share * span, at + (1 - share) * span);
  }

  /** Shows a span of time. @param {number} t0 @param {number} t1 */
  show(t0, t1) {
    const span = Math.min(t1 - t0, this.end);
    const start = Math.min(Math.max(t0, 0), this.end - span);
    if (this.window[0] === start && this.window[1] === start + span) return;
    this.window = [start, start + span];
    if (!this.pending) {
      this.pending = true;
      requestAnimationFrame(() => {
        this.pending = false;
        for (const made of this.strips) {
          made.chart?.setData(this.data(made, made.chart.width));
          this.place(made);
        }
        this.on.windowChanged(this.window[0], this.window[1]);
      });
    }
  }

  /** Moves the line of the present time; the window follows it while playing. @param {number} t @param {boolean} follows */
  setHead(t, follows) {
    this.head = t;
    const [t0, t1] = this.window;
    if (follows && t > t1 && t1 < this.end) this.show(t, t + (t1 - t0));
    if (follows && t < t0) this.show(t, t + (t1 - t0));
    for (const made of this.strips) this.place(made);
  }

  /** @param {any} made */
  place(made) {
    const [t0, t1] = this.window;
    const share = (this.head - t0) / (t1 - t0 || 1);
    const isVisible = share >= 0 && share <= 1;
    made.line.hidden = !isVisible;
    if (isVisible && made.chart) {
      made.line.style.height = `${made.chart.over.clientHeight}px`;
      made.line.style.transform = `translateX(${(share * made.chart.over.clientWidth).toFixed(1)}px)`;
    }
  }

  resize() {
    const width = this.parent.clientWidth;
    if (width === this.width || width === 0) return;
    this.width = width;
    for (const made of this.strips) {
      made.chart?.setSize({ width, height: HEIGHT });
      made.chart?.setData(this.data(made, width));
      this.place(made);
    }
  }

  retheme() {
    for (const made of this.strips) this.build(made);
  }
}

/** @param {uPlot} u @param {number[]} limits @param {string} color */
function drawLimits(u, limits, color) {
  const { ctx } = u;
  ctx.save();
  ctx.strokeStyle = color;
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([6 * devicePixelRatio, 4 * devicePixelRatio]);
  for (const limit of limits) {
    const y = Math.round(u.valToPos(limit, "y", true));
    ctx.beginPath();
    ctx.moveTo(u.bbox.left, y);
    ctx.lineTo(u.bbox.left + u.bbox.width, y);
    ctx.stroke();
  }
  ctx.restore();
}

/**
 * The strips of a plan.
 * @param {any} meta @param {import("./plan.js").Track} rows @param {import("./plan.js").Motion} moving
 * @returns {Strip[]}
 */
export function stripsOf(meta, rows, moving) {
  const motors = meta.machine.motors;
  const colors = ["motor-a", "motor-b"];
  const shares = (/** @type {(Float32Array | null)[]} */ of, /** @type {string} */ key, /** @type {string} */ unit) =>
    motors.flatMap((/** @type {any} */ motor, /** @type {number} */ k) => {
      const values = of[k];
      if (!values) return [];
      const percents = values.map((value) => 100 * value);
      const text = (/** @type {number} */ value) => `${short((value / 100) * motor[key])} ${unit} (${percent(value / 100)})`;
      return [{ name: motor.name, values: percents, color: colors[k], text }];
    });
  const averaged = moving.averaged_s ? ` (mean of ${(1000 * moving.averaged_s).toFixed(0)} ms)` : "";
  const speedLimit = meta.machine.pen.speed_mm_s;
  /** @type {Strip[]} */
  const strips = [{
    title: "Pen speed",
    unit: "mm/s",
    series: [{ name: "pen", values: moving.pen, color: "pen-line", text: (value) => `${value.toFixed(1)} mm/s` }],
    limits: [speedLimit],
    stepped: true,
  }, {
    title: "Speed",
    unit: `% of the limit${averaged}`,
    series: shares(moving.speed, "speed", "ticks/s"),
    limits: [-100, 100],
    full: 100,
    stepped: true,
  }, {
    title: "Acceleration",
    unit: `% of the limit${averaged}`,
    series: shares(moving.acceleration, "acceleration", "ticks/s²"),
    limits: [-100, 100],
    full: 100,
    stepped: true,
  }];
  if (moving.jerk.some((jerk) => jerk)) {
    strips.push({
      title: "Jerk",
      unit: `% of the limit${averaged}`,
      series: shares(moving.jerk, "jerk", "ticks/s³"),
      limits: [-100, 100],
      full: 100,
      stepped: true,
    });
  }
  strips.push({
    title: "Position",
    unit: "ticks",
    series: motors.map((/** @type {any} */ motor, /** @type {number} */ k) => ({
      name: motor.name, values: rows.q[k], color: colors[k], text: (/** @type {number} */ value) => `${short(value)} ticks`,
    })),
    limits: [],
  });
  return strips;
}
