// The picture: sheet, reach and strokes to come (base), ink so far (ink), and all that moves (front).
// Three canvases lie over each other, so that a frame draws only what changed.

import { pose } from "./machine.js";
import { strokeAt } from "./plan.js";
import { theme } from "./colors.js";

/** Ink is as wide as a common pen where the file states no width, mm. */
const INK_MM = 0.3;
/** Ink that is drawn in pieces gets this much of a frame, ms: while playing, and else. */
const SLICES_MS = { playing: 7, still: 30 };
/** Below this scale, CSS pixels per mm, strokes are drawn from their corner points. */
const COARSE_BELOW = 14;
/** Corner points leave a stroke by at most this, mm. */
const COARSE_MM = 0.02;

/**
 * @typedef {import("./plan.js").Track} Track
 * @typedef {{levels: Uint8Array | null, colors: string[]}} Shading  the level of each row and the
 *   levels' colours; without levels ink has its pens' colours
 */

export class Picture {
  /**
   * @param {{base: HTMLCanvasElement, ink: HTMLCanvasElement, front: HTMLCanvasElement}} canvases
   * @param {any} meta @param {Track} rows @param {Track | null} predicted
   * @param {Picture | null} before  the picture in whose place this one comes: its view stays
   */
  constructor(canvases, meta, rows, predicted, before) {
    this.canvases = canvases;
    this.meta = meta;
    this.rows = rows;
    this.predicted = predicted;
    this.pose = pose(meta.machine);
    /** @type {Map<number, {color: string, width_mm: number}>} */
    this.pens = new Map(meta.pens.map((/** @type {any} */ pen) => [pen.number, { color: pen.color, width_mm: pen.width_mm ?? INK_MM }]));
    this.shows = { machine: true, travel: true, ahead: true, reach: true, predicted: true };
    /** @type {Shading} */
    this.shading = { levels: null, colors: [] };
    this.scale = 1;
    this.x = 0;
    this.y = 0;
    this.width = 1;
    this.height = 1;
    this.selected = -1;
    /** @type {[number, number] | null} */
    this.hovered = null;
    /** @type {[number, number, number, number] | null} */
    this.measured = null;
    /** Row up to which ink is on the canvas, and its track's row for predicted ink. */
    this.drawn = { row: 0, predicted: 0, ahead: 0 };
    this.target = { row: 0, predicted: 0 };
    this.theme = theme();
    this.corners = corners(rows);
    this.boxes = boxes(rows);
    this.stale = true;
    if (before) this.keep(before);
  }

  /** Takes the view of another picture. @param {Picture} before */
  keep(before) {
    Object.assign(this.shows, before.shows);
    for (const name of /** @type {const} */ (["scale", "x", "y", "width", "height", "ratio", "isFit"])) {
      Object.assign(this, { [name]: before[name] });
    }
    const sheets = [this, before].map((picture) => picture.meta.machine.sheet_mm.join());
    if (sheets[0] !== sheets[1]) this.fit();
  }

  /** The size of the stage changed. @param {number} width @param {number} height */
  resize(width, height) {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const keepsPlace = this.width > 1;
    const [cx, cy] = this.toMachine(this.width / 2, this.height / 2);
    for (const canvas of Object.values(this.canvases)) {
      canvas.width = Math.max(Math.round(width * ratio), 1);
      canvas.height = Math.max(Math.round(height * ratio), 1);
    }
    this.ratio = ratio;
    this.width = width;
    this.height = height;
    if (keepsPlace && !this.isFit) this.center(cx, cy);
    else this.fit();
  }

  /** Shows sheet, ink and as much of the machine as helps. */
  fit() {
    const [x0, y0, x1, y1] = this.extent();
    const margin = 18;
    this.scale = Math.min((this.width - 2 * margin) / (x1 - x0), (this.height - 2 * margin) / (y1 - y0));
    this.scale = Math.max(this.scale, 1e-3);
    this.center((x0 + x1) / 2, (y0 + y1) / 2);
    this.isFit = true;
  }

  /** @returns {[number, number, number, number]} */
  extent() {
    let [x0, y0, x1, y1] = this.meta.machine.sheet_mm;
    const include = (/** @type {number} */ x, /** @type {number} */ y) => {
      [x0, y0, x1, y1] = [Math.min(x0, x), Math.min(y0, y), Math.max(x1, x), Math.max(y1, y)];
    };
    for (let stroke = 0; stroke < this.rows.first.length; stroke++) {
      include(this.boxes[4 * stroke], this.boxes[4 * stroke + 1]);
      include(this.boxes[4 * stroke + 2], this.boxes[4 * stroke + 3]);
    }
    for (const anchor of this.meta.machine.linkage.anchors) if ("x" in anchor) include(anchor.x, anchor.y);
    include(this.rows.x[0], this.rows.y[0]);
    return [x0, y0, x1, y1];
  }

  /** @param {number} x @param {number} y machine mm in the middle of the stage */
  center(x, y) {
    this.x = this.width / 2 - x * this.scale;
    this.y = this.height / 2 + y * this.scale;
    this.isFit = false;
    this.stale = true;
  }

  /** @param {number} dx @param {number} dy CSS pixels */
  pan(dx, dy) {
    this.x += dx;
    this.y += dy;
    this.isFit = false;
    this.stale = true;
  }

  /** @param {number} factor @param {number} px @param {number} py the place that stays, CSS pixels */
  zoom(factor, px = this.width / 2, py = this.height / 2) {
    const scale = Math.min(Math.max(this.scale * factor, 0.02), 2000);
    const actual = scale / this.scale;
    this.x = px - actual * (px - this.x);
    this.y = py - actual * (py - this.y);
    this.scale = scale;
    this.isFit = false;
    this.stale = true;
  }

  /** @param {number} px @param {number} py @returns {[number, number]} */
  toMachine(px, py) {
    return [(px - this.x) / this.scale, (this.y - py) / this.scale];
  }

  /** @param {Shading} shading */
  shade(shading) {
    this.shading = shading;
    this.stale = true;
  }

  /** Reads the theme's colours again. */
  retheme() {
    this.theme = theme();
    this.stale = true;
  }

  /**
   * Draws what a frame needs. Ink up to `row` and everything that moves; more ink than fits into a
   * frame follows in the next ones. Returns whether anything is left.
   * @param {{row: number, motors: [number, number], predictedRow: number, predictedMotors: [number, number] | null, isPlaying: boolean, tool: import("./viewer.js").Tool | null}} now
   */
  frame(now) {
    if (this.stale) {
      this.clearAll();
      this.stale = false;
    }
    const isBack = now.row < this.drawn.row || now.predictedRow < this.drawn.predicted;
    if (isBack) this.clearInk();
    this.target = { row: now.row, predicted: now.predictedRow };
    const until = performance.now() + (now.isPlaying ? SLICES_MS.playing : SLICES_MS.still);
    this.drawAhead(until);
    this.drawInk(until);
    this.drawFront(now);
    return this.drawn.ahead < this.rows.first.length || this.drawn.row < now.row || this.drawn.predicted < now.predictedRow;
  }

  /** @param {HTMLCanvasElement} canvas */
  context(canvas) {
    const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const ratio = this.ratio ?? 1;
    const scale = this.scale * ratio;
    context.setTransform(scale, 0, 0, -scale, this.x * ratio, this.y * ratio);
    context.lineCap = "round";
    context.lineJoin = "round";
    return context;
  }

  /** @param {CanvasRenderingContext2D} context */
  clear(context) {
    context.save();
    context.resetTransform();
    context.clearRect(0, 0, context.canvas.width, context.canvas.height);
    context.restore();
  }

  /** A width of at least so many CSS pixels. @param {number} mm @param {number} px */
  wide(mm, px) {
    return Math.max(mm, px / this.scale);
  }

  clearInk() {
    this.clear(this.context(this.canvases.ink));
    this.drawn.row = 0;
    this.drawn.predicted = 0;
  }

  clearAll() {
    this.clearInk();
    const context = this.context(this.canvases.base);
    this.clear(context);
    const { machine } = this.meta;
    const [x0, y0, x1, y1] = machine.sheet_mm;
    if (this.shows.reach) {
      const outline = new Path2D();
      for (const points of machine.reach_mm) {
        for (let k = 0; k < points.length; k += 2) {
          if (k === 0) outline.moveTo(points[0], points[1]);
          else outline.lineTo(points[k], points[k + 1]);
        }
        outline.closePath();
      }
      context.fillStyle = this.theme.reach;
      context.fill(outline, "evenodd");
      context.strokeStyle = this.theme["reach-line"];
      context.lineWidth = this.wide(0, 1);
      context.stroke(outline);
    }
    context.fillStyle = this.theme.paper;
    context.fillRect(x0, y0, x1 - x0, y1 - y0);
    context.strokeStyle = this.theme["paper-line"];
    context.lineWidth = this.wide(0, 1);
    context.strokeRect(x0, y0, x1 - x0, y1 - y0);
    this.drawn.ahead = this.shows.ahead ? 0 : this.rows.first.length;
  }

  /** Whether any of a stroke is on the stage. @param {number} stroke */
  isVisible(stroke) {
    const [left, top] = this.toMachine(-4, -4);
    const [right, bottom] = this.toMachine(this.width + 4, this.height + 4);
    const b = this.boxes;
    const k = 4 * stroke;
    return b[k] <= right && b[k + 2] >= left && b[k + 1] <= top && b[k + 3] >= bottom;
  }

  /** Adds rows of a stroke to a path. @param {Path2D} path @param {number} stroke @param {number} from @param {number} to */
  addInk(path, stroke, from, to) {
    const { x, y } = this.rows;
    path.moveTo(x[from], y[from]);
    if (this.scale < COARSE_BELOW) {
      const { rows, starts } = this.corners;
      let k = starts[stroke];
      const end = starts[stroke + 1];
      while (k < end && rows[k] <= from) k++;
      for (; k < end && rows[k] < to; k++) path.lineTo(x[rows[k]], y[rows[k]]);
    } else {
      for (let row = from + 1; row < to; row++) path.lineTo(x[row], y[row]);
    }
    path.lineTo(x[to], y[to]);
  }

  /** Strokes to come, in the order drawn. @param {number} until */
  drawAhead(until) {
    const strokes = this.rows.first.length;
    if (this.drawn.ahead >= strokes) return;
    const context = this.context(this.canvases.base);
    context.strokeStyle = this.theme.ahead;
    context.lineWidth = this.wide(INK_MM, 1);
    while (this.drawn.ahead < strokes && performance.now() < until) {
      const path = new Path2D();
      const end = Math.min(this.drawn.ahead + 500, strokes);
      for (let stroke = this.drawn.ahead; stroke < end; stroke++) {
        if (this.isVisible(stroke)) this.addInk(path, stroke, this.rows.first[stroke], this.rows.last[stroke]);
      }
      context.stroke(path);
      this.drawn.ahead = end;
    }
  }

  /** @param {number} until */
  drawInk(until) {
    const context = this.context(this.canvases.ink);
    const comparing = this.predicted !== null && this.shows.predicted;
    while (this.drawn.row < this.target.row && performance.now() < until) {
      this.drawn.row = this.drawPiece(context, this.drawn.row, this.target.row, comparing);
    }
    if (!comparing) {
      this.drawn.predicted = this.target.predicted;
      return;
    }
    while (this.drawn.predicted < this.target.predicted && performance.now() < until) {
      const end = Math.min(this.drawn.predicted + 4000, this.target.predicted);
      this.drawPredicted(context, this.drawn.predicted, end);
      this.drawn.predicted = end;
    }
  }

  /**
   * Draws ink from a row, at most up to another one; returns how far.
   * @param {CanvasRenderingContext2D} context @param {number} from @param {number} to @param {boolean} asReference
   */
  drawPiece(context, from, to, asReference) {
    const { first, last, pen } = this.rows;
    const { levels, colors } = this.shading;
    let stroke = Math.max(strokeAt(this.rows, from), 0);
    let reached = from;
    let left = 4000;
    /** @type {Map<string, {path: Path2D, width: number}>} */
    const paths = new Map();
    const pathOf = (/** @type {string} */ color, /** @type {number} */ width) => {
      const found = paths.get(color);
      if (found) return found.path;
      const path = new Path2D();
      paths.set(color, { path, width });
      return path;
    };
    for (; stroke < first.length && first[stroke] < to && left > 0; stroke++) {
      const start = Math.max(first[stroke], from);
      const end = Math.min(last[stroke], to);
      reached = Math.max(reached, Math.min(last[stroke] + 1, to));
      if (start > end || !this.isVisible(stroke)) continue;
      left -= this.scale < COARSE_BELOW && !levels ? 4 : end - start + 2;
      const style = this.pens.get(pen[first[stroke]]) ?? { color: "#000000", width_mm: INK_MM };
      if (asReference) {
        this.addInk(pathOf(this.theme.reference, 0.9), stroke, start, end);
      } else if (!levels) {
        this.addInk(pathOf(style.color, style.width_mm), stroke, start, end);
      } else {
        this.addShaded(levels, start, end, (level) => pathOf(colors[level], style.width_mm));
      }
    }
    if (stroke >= first.length || first[stroke] >= to) reached = to;
    for (const [color, { path, width }] of paths) {
      context.strokeStyle = color;
      context.lineWidth = this.wide(width, this.shading.levels ? 1.8 : 1.2);
      context.stroke(path);
    }
    return reached;
  }

  /**
   * Rows of one level in turn are one line; steps below a pixel are left out.
   * @param {Uint8Array} levels @param {number} start @param {number} end @param {(level: number) => Path2D} pathOf
   */
  addShaded(levels, start, end, pathOf) {
    const { x, y } = this.rows;
    const least = 1 / this.scale;
    let row = start;
    if (start === end) {
      const path = pathOf(levels[start]);
      path.moveTo(x[start], y[start]);
      path.lineTo(x[start], y[start]);
    }
    while (row < end) {
      const level = levels[row];
      const path = pathOf(level);
      path.moveTo(x[row], y[row]);
      let [px, py] = [x[row], y[row]];
      row++;
      while (row < end && levels[row] === level) {
        if (Math.abs(x[row] - px) + Math.abs(y[row] - py) >= least) {
          [px, py] = [x[row], y[row]];
          path.lineTo(px, py);
        }
        row++;
      }
      path.lineTo(x[row], y[row]);
    }
  }

  /** @param {CanvasRenderingContext2D} context @param {number} from @param {number} to */
  drawPredicted(context, from, to) {
    const track = this.predicted;
    if (!track) return;
    let row = from;
    while (row < to) {
      const pen = track.pen[row];
      const path = new Path2D();
      path.moveTo(track.x[row], track.y[row]);
      while (row < to && track.pen[row] === pen) {
        row++;
        path.lineTo(track.x[row], track.y[row]);
      }
      if (pen === 0) continue;
      const style = this.pens.get(pen) ?? { color: "#000000", width_mm: INK_MM };
      context.strokeStyle = style.color;
      context.lineWidth = this.wide(style.width_mm, 1.2);
      context.stroke(path);
    }
  }

  /** @param {{row: number, motors: [number, number], predictedMotors: [number, number] | null, tool: import("./viewer.js").Tool | null}} now */
  drawFront(now) {
    const context = this.context(this.canvases.front);
    this.clear(context);
    const { pen } = this.meta.machine.linkage;
    const points = this.pose(now.motors[0], now.motors[1]);
    const [px, py] = [points[2 * pen], points[2 * pen + 1]];
    const isDown = this.rows.pen[now.row] !== 0;
    const style = this.pens.get(this.rows.pen[now.row]);
    if (this.shows.travel) this.drawTravel(context, now.row, px, py);
    if (isDown && !(this.predicted && this.shows.predicted)) {
      // From the last whole row to the pen: this ink is not on the ink canvas yet.
      context.strokeStyle = style?.color ?? "#000000";
      context.lineWidth = this.wide(style?.width_mm ?? INK_MM, 1.2);
      line(context, [[this.rows.x[now.row], this.rows.y[now.row]], [px, py]]);
    }
    this.drawSelected(context);
    if (this.shows.machine) {
      if (now.predictedMotors) {
        this.drawMachine(context, Float64Array.from(points), true);
        this.drawMachine(context, this.pose(now.predictedMotors[0], now.predictedMotors[1]), false);
      } else {
        this.drawMachine(context, points, false);
      }
    }
    this.drawPen(context, px, py, isDown ? style?.color ?? "#000000" : null);
    this.drawMarks(context);
    now.tool?.draw(context, this);
  }

  /**
   * The present travel, as far as it goes.
   * @param {CanvasRenderingContext2D} context @param {number} row @param {number} px @param {number} py
   */
  drawTravel(context, row, px, py) {
    const { pen, x, y, t } = this.rows;
    if (pen[row] !== 0) return;
    let start = row;
    while (start > 0 && pen[start - 1] === 0 && row - start < 20000) start--;
    let end = row;
    while (end < t.length - 1 && pen[end] === 0 && end - row < 20000) end++;
    context.save();
    context.strokeStyle = this.theme.travel;
    context.lineWidth = this.wide(0, 1.2);
    context.setLineDash([5 / this.scale, 4 / this.scale]);
    context.beginPath();
    context.moveTo(x[start], y[start]);
    const step = Math.max(Math.floor((end - start) / 400), 1);
    for (let k = start + step; k < row; k += step) context.lineTo(x[k], y[k]);
    context.lineTo(px, py);
    context.stroke();
    context.globalAlpha = 0.45;
    context.beginPath();
    context.moveTo(px, py);
    for (let k = row + 1; k < end; k += step) context.lineTo(x[k], y[k]);
    context.lineTo(x[end], y[end]);
    context.stroke();
    context.restore();
  }

  /** @param {CanvasRenderingContext2D} context */
  drawSelected(context) {
    if (this.selected < 0) return;
    const path = new Path2D();
    this.addInk(path, this.selected, this.rows.first[this.selected], this.rows.last[this.selected]);
    context.save();
    context.strokeStyle = this.theme.select;
    context.globalAlpha = 0.35;
    context.lineWidth = this.wide(0.6, 9);
    context.stroke(path);
    context.globalAlpha = 1;
    context.lineWidth = this.wide(INK_MM, 2.5);
    context.stroke(path);
    context.restore();
  }

  /** @param {CanvasRenderingContext2D} context @param {Float64Array} points @param {boolean} isGhost */
  drawMachine(context, points, isGhost) {
    const { parts } = this.meta.machine.linkage;
    context.save();
    context.globalAlpha = isGhost ? 0.55 : 0.85;
    if (isGhost) context.setLineDash([6 / this.scale, 5 / this.scale]);
    for (const part of parts) {
      const ends = [part.from, part.to].map((k) => [points[2 * k], points[2 * k + 1]]);
      const isRail = part.kind === "rail";
      if (part.kind === "pivot") continue;
      context.strokeStyle = isGhost ? this.theme.ghost : this.theme.machine;
      context.lineWidth = this.wide(isRail ? 1.5 : 3, isGhost ? 1.5 : isRail ? 4 : 8);
      line(context, ends);
      if (!isGhost && !isRail) {
        context.strokeStyle = this.theme["machine-fill"];
        context.lineWidth = this.wide(1.8, 4.5);
        line(context, ends);
      }
    }
    context.setLineDash([]);
    for (const part of parts) {
      if (part.kind !== "pivot") continue;
      context.beginPath();
      context.arc(points[2 * part.from], points[2 * part.from + 1], this.wide(2.2, isGhost ? 3 : 6), 0, 2 * Math.PI);
      context.fillStyle = isGhost ? this.theme.ghost : this.theme.panel;
      context.fill();
      context.strokeStyle = isGhost ? this.theme.ghost : this.theme.machine;
      context.lineWidth = this.wide(0, 2);
      context.stroke();
    }
    context.restore();
  }

  /** Filled while it draws, a ring while it is up. @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {string | null} color */
  drawPen(context, x, y, color) {
    context.save();
    context.beginPath();
    context.arc(x, y, this.wide(0, 5), 0, 2 * Math.PI);
    context.fillStyle = color ?? this.theme.paper;
    context.fill();
    context.strokeStyle = color ? this.theme.paper : this.theme.head;
    context.lineWidth = this.wide(0, 2);
    context.stroke();
    context.beginPath();
    context.arc(x, y, this.wide(0, 7), 0, 2 * Math.PI);
    context.strokeStyle = this.theme.head;
    context.lineWidth = this.wide(0, 1.5);
    context.stroke();
    context.restore();
  }

  /** @param {CanvasRenderingContext2D} context */
  drawMarks(context) {
    context.save();
    if (this.hovered) {
      context.strokeStyle = this.theme.accent;
      context.lineWidth = this.wide(0, 2);
      context.beginPath();
      context.arc(this.hovered[0], this.hovered[1], this.wide(0, 9), 0, 2 * Math.PI);
      context.stroke();
    }
    if (this.measured) {
      const [x0, y0, x1, y1] = this.measured;
      context.strokeStyle = this.theme.select;
      context.lineWidth = this.wide(0, 2);
      line(context, [[x0, y0], [x1, y1]]);
      for (const [x, y] of [[x0, y0], [x1, y1]]) {
        const arm = 6 / this.scale;
        line(context, [[x - arm, y], [x + arm, y]]);
        line(context, [[x, y - arm], [x, y + arm]]);
      }
    }
    context.restore();
  }

  /**
   * The stroke whose ink is nearest to a place on the stage, within some pixels, and the row there.
   * @param {number} px @param {number} py @returns {{stroke: number, row: number} | null}
   */
  strokeNear(px, py) {
    const [mx, my] = this.toMachine(px, py);
    let best = 10 / this.scale;
    let found = null;
    const { first, last, x, y } = this.rows;
    for (let stroke = 0; stroke < first.length; stroke++) {
      const k = 4 * stroke;
      const b = this.boxes;
      if (b[k] > mx + best || b[k + 2] < mx - best || b[k + 1] > my + best || b[k + 3] < my - best) continue;
      for (let row = first[stroke]; row <= last[stroke]; row++) {
        const next = Math.min(row + 1, last[stroke]);
        const distance = toSegment(mx, my, x[row], y[row], x[next], y[next]);
        if (distance < best) {
          best = distance;
          found = { stroke, row };
        }
      }
    }
    return found;
  }

  /** Brings a stroke into view, if it is not. @param {number} stroke */
  reveal(stroke) {
    const k = 4 * stroke;
    const b = this.boxes;
    const [cx, cy] = [(b[k] + b[k + 2]) / 2, (b[k + 1] + b[k + 3]) / 2];
    const [px, py] = [this.x + cx * this.scale, this.y - cy * this.scale];
    const inside = px > 0 && py > 0 && px < this.width && py < this.height;
    if (!inside) this.center(cx, cy);
  }
}

/** @param {CanvasRenderingContext2D} context @param {number[][]} points */
function line(context, points) {
  context.beginPath();
  points.forEach(([x, y], k) => (k === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
  context.stroke();
}

/** The distance of a point from a line segment. */
function toSegment(/** @type {number} */ px, /** @type {number} */ py, /** @type {number} */ ax, /** @type {number} */ ay, /** @type {number} */ bx, /** @type {number} */ by) {
  const [dx, dy] = [bx - ax, by - ay];
  const square = dx * dx + dy * dy;
  const share = square > 0 ? Math.min(Math.max(((px - ax) * dx + (py - ay) * dy) / square, 0), 1) : 0;
  return Math.hypot(px - ax - share * dx, py - ay - share * dy);
}

/** x0, y0, x1, y1 of every stroke. @param {Track} rows */
function boxes(rows) {
  const result = new Float32Array(4 * rows.first.length);
  for (let stroke = 0; stroke < rows.first.length; stroke++) {
    let [x0, y0, x1, y1] = [Infinity, Infinity, -Infinity, -Infinity];
    for (let row = rows.first[stroke]; row <= rows.last[stroke]; row++) {
      const x = rows.x[row];
      const y = rows.y[row];
      if (x < x0) x0 = x;
      if (x > x1) x1 = x;
      if (y < y0) y0 = y;
      if (y > y1) y1 = y;
    }
    result.set([x0, y0, x1, y1], 4 * stroke);
  }
  return result;
}

/**
 * The rows of each stroke between which it is straight within `COARSE_MM`: from each corner, a row
 * is left out while the directions to all rows since the corner share a sector of that half width.
 * @param {Track} rows @returns {{rows: Int32Array, starts: Int32Array}}
 */
function corners(rows) {
  const kept = [];
  const starts = new Int32Array(rows.first.length + 1);
  const { x, y } = rows;
  for (let stroke = 0; stroke < rows.first.length; stroke++) {
    starts[stroke] = kept.length;
    const end = rows.last[stroke];
    let corner = rows.first[stroke];
    let [low, high, far] = [-Infinity, Infinity, 0];
    let axis = 0;
    for (let row = corner + 1; row <= end; row++) {
      const [dx, dy] = [x[row] - x[corner], y[row] - y[corner]];
      const distance = Math.hypot(dx, dy);
      if (distance <= COARSE_MM) continue;
      const angle = Math.atan2(dy, dx);
      if (far === 0) axis = angle;
      let off = angle - axis;
      if (off > Math.PI) off -= 2 * Math.PI;
      else if (off < -Math.PI) off += 2 * Math.PI;
      const half = Math.asin(Math.min(COARSE_MM / distance, 1));
      if (off < low || off > high || distance < far - COARSE_MM) {
        corner = row - 1;
        kept.push(corner);
        [low, high, far] = [-Infinity, Infinity, 0];
        row--;
        continue;
      }
      low = Math.max(low, off - half);
      high = Math.min(high, off + half);
      far = Math.max(far, distance);
    }
  }
  starts[rows.first.length] = kept.length;
  return { rows: Int32Array.from(kept), starts };
}
