// The whole time of the plan as a slider, with a band in its pen's colour for every stroke.

import { time } from "./format.js";

export class Scrubber {
  /**
   * @param {HTMLElement} box @param {HTMLCanvasElement} bands @param {HTMLElement} head @param {HTMLElement} window
   * @param {(t: number) => void} seek
   */
  constructor(box, bands, head, window, seek) {
    this.box = box;
    this.bands = bands;
    this.head = head;
    this.window = window;
    /** @type {import("./plan.js").Track | null} */
    this.rows = null;
    this.end = 1;
    const at = (/** @type {PointerEvent} */ event) => {
      const { left, width } = box.getBoundingClientRect();
      seek(Math.min(Math.max((event.clientX - left) / width, 0), 1) * this.end);
    };
    box.addEventListener("pointerdown", (event) => {
      box.setPointerCapture(event.pointerId);
      this.isDragged = true;
      at(event);
    });
    box.addEventListener("pointermove", (event) => {
      if (this.isDragged) at(event);
    });
    for (const type of ["pointerup", "pointercancel"]) box.addEventListener(type, () => (this.isDragged = false));
    new ResizeObserver(() => this.draw()).observe(box);
  }

  /**
   * Shows the strokes of a plan.
   * @param {import("./plan.js").Track} rows @param {(pen: number) => string} colorOf @param {number} end s
   */
  show(rows, colorOf, end) {
    this.rows = rows;
    this.colorOf = colorOf;
    this.end = end || 1;
    this.shown = undefined;
    this.box.setAttribute("aria-valuemax", this.end.toFixed(2));
    this.draw();
  }

  draw() {
    if (!this.rows) return;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const width = Math.max(Math.round(this.box.clientWidth * ratio), 1);
    const height = Math.max(Math.round(this.box.clientHeight * ratio), 1);
    this.bands.width = width;
    this.bands.height = height;
    const context = /** @type {CanvasRenderingContext2D} */ (this.bands.getContext("2d"));
    const { first, last, t, pen } = this.rows;
    // A pixel column shows the share of its time with the pen down.
    /** @type {Map<number, Float32Array>} */
    const shares = new Map();
    for (let stroke = 0; stroke < first.length; stroke++) {
      const [from, to] = [(t[first[stroke]] / this.end) * width, (t[last[stroke]] / this.end) * width];
      const number = pen[first[stroke]];
      const share = shares.get(number) ?? new Float32Array(width + 1);
      shares.set(number, share);
      for (let x = Math.floor(from); x <= Math.min(to, width); x++) {
        share[x] += Math.max(Math.min(to, x + 1) - Math.max(from, x), 0);
      }
    }
    const bottoms = new Float32Array(width + 1).fill(height);
    for (const [number, share] of [...shares].sort((a, b) => a[0] - b[0])) {
      context.fillStyle = this.colorOf?.(number) ?? "#000000";
      for (let x = 0; x < width; x++) {
        if (share[x] <= 0) continue;
        const size = Math.max(share[x] * (height - 6 * ratio), 2);
        context.fillRect(x, bottoms[x] - size, 1, size);
        bottoms[x] -= size;
      }
    }
    this.set(this.t ?? 0);
    this.showWindow(...(this.shown ?? [0, this.end]));
  }

  /** @param {number} t */
  set(t) {
    this.t = t;
    this.head.style.transform = `translateX(${((t / this.end) * this.box.clientWidth).toFixed(1)}px)`;
  }

  /** For screen readers: changes that are not worth a frame's time. @param {string} text */
  describe(text) {
    this.box.setAttribute("aria-valuenow", (this.t ?? 0).toFixed(2));
    this.box.setAttribute("aria-valuetext", `${time(this.t ?? 0)}, ${text}`);
  }

  /** The span of time that the strips show. @param {number} t0 @param {number} t1 */
  showWindow(t0, t1) {
    this.shown = /** @type {[number, number]} */ ([t0, t1]);
    this.window.hidden = t0 <= 0 && t1 >= this.end;
    this.window.style.left = `${(100 * t0) / this.end}%`;
    this.window.style.width = `${(100 * (t1 - t0)) / this.end}%`;
  }
}
