// Sketching on the sheet with mouse, finger or pen. The sketch is an SVG drawing of the sheet's size.

import { byId } from "../viewer/js/dom.js";
import { smooth } from "./smooth.js";
import { toBase64 } from "./state.js";

/** The pens: name and colour. @type {Record<number, [string, string]>} */
const PENS = { 1: ["black", "#1c1c1c"], 2: ["red", "#c03028"], 3: ["green", "#1f7a3a"], 4: ["blue", "#2050a8"] };
/** The drawing's file. */
const NAME = "sketch.svg";

/** @typedef {import("./state.js").Stroke} Stroke */

/** A coordinate in micrometres' steps. @param {number} mm */
function text(mm) {
  return String(Number(mm.toFixed(3)));
}

/**
 * The sketch as SVG: a layer for each pen, strokes smoothed within the tolerance.
 * @param {Stroke[]} strokes @param {number} width mm @param {number} height mm @param {number} tolerance mm
 */
export function svgOf(strokes, width, height, tolerance) {
  const pairs = (/** @type {number[]} */ points) => Array.from({ length: points.length / 2 }, (_, k) => /** @type {[number, number]} */ ([points[2 * k], height - points[2 * k + 1]]));
  const path = (/** @type {Stroke} */ stroke) => {
    const points = pairs(stroke.points);
    const start = `M${points[0].map(text).join(" ")}`;
    if (tolerance > 0) {
      const curves = smooth(points, tolerance);
      if (curves.length > 0) return start + curves.map((curve) => `C${curve.slice(1).flat().map(text).join(" ")}`).join("");
    }
    const rest = points.slice(1).map((point) => `L${point.map(text).join(" ")}`).join("");
    // A tap is a dot.
    return start + (rest || "h0.1");
  };
  const layers = Object.entries(PENS).flatMap(([pen, [name, color]]) => {
    const mine = strokes.filter((stroke) => stroke.pen === Number(pen));
    if (mine.length === 0) return [];
    const paths = mine.map((stroke) => `    <path d="${path(stroke)}"/>`).join("\n");
    return [`  <g inkscape:groupmode="layer" inkscape:label="${pen} ${name}" fill="none" stroke="${color}" stroke-width="0.5" stroke-linecap="round">\n${paths}\n  </g>`];
  });
  return `<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" width="${text(width)}mm" height="${text(height)}mm" viewBox="0 0 ${text(width)} ${text(height)}">\n${layers.join("\n")}\n</svg>\n`;
}

export class Sketch {
  /** @param {import("./studio.js").Studio} studio */
  constructor(studio) {
    this.studio = studio;
    this.isOn = false;
    /** @type {Stroke[]} */
    this.strokes = [];
    /** @type {Stroke[]} */
    this.undone = [];
    /** @type {Stroke | null} */
    this.current = null;
    byId("sketch").addEventListener("click", () => (this.isOn ? this.pause() : this.begin(this.studio.state.sketch ?? [])));
    byId("undo").addEventListener("click", () => this.undo());
    byId("redo").addEventListener("click", () => this.redo());
    byId("clear").addEventListener("click", () => {
      this.undone = [];
      this.strokes = [];
      this.changed();
    });
    const tolerance = /** @type {HTMLInputElement} */ (byId("smooth"));
    tolerance.addEventListener("change", () => {
      this.studio.state.smooth = tolerance.value || "0";
      this.changed();
    });
    document.addEventListener("keydown", (event) => {
      const target = /** @type {HTMLElement} */ (event.target);
      if (!this.isOn || !(event.ctrlKey || event.metaKey) || ["INPUT", "TEXTAREA"].includes(target.tagName)) return;
      const key = event.key.toLowerCase();
      if (key !== "z" && key !== "y") return;
      event.preventDefault();
      if (key === "y" || event.shiftKey) this.redo();
      else this.undo();
    });
  }

  /** Starts to sketch. @param {Stroke[]} strokes */
  async begin(strokes) {
    this.studio.placer.end();
    const { placement } = this.studio.placer;
    const isPlaced = this.studio.state.sketch !== null && this.studio.hasDrawing && placement;
    this.isOn = true;
    this.strokes = isPlaced ? strokes.map((stroke) => this.moved(stroke, placement)) : strokes;
    this.undone = [];
    // In its own place on the sheet, so that ink appears under the pointer.
    Object.assign(this.studio.state.options, { fit: false, align: "", place: "", scale: "", rotate: "", mirror: "", page: "", pens: "" });
    this.studio.showFields();
    this.show();
    await this.changed();
  }

  /** A stroke where the sketch was placed. @param {Stroke} stroke @param {import("./outline.js").Affine} placement @returns {Stroke} */
  moved({ pen, points }, [a, b, c, d, e, f]) {
    const [x0, y0] = this.studio.viewer.meta.machine.sheet_mm;
    const at = (/** @type {number} */ k) => [a * points[k] + c * points[k + 1] + e - x0, b * points[k] + d * points[k + 1] + f - y0];
    return { pen, points: points.flatMap((_, k) => (k % 2 === 0 ? at(k).map((mm) => Number(mm.toFixed(3))) : [])) };
  }

  /** Leaves the pointer to the picture; the sketch stays. */
  pause() {
    this.isOn = false;
    this.current = null;
    this.show();
  }

  /** Another drawing takes its place. */
  end() {
    this.pause();
    this.strokes = [];
    this.undone = [];
  }

  show() {
    const { viewer } = this.studio;
    byId("sketch").setAttribute("aria-pressed", String(this.isOn));
    byId("sketching").hidden = !this.isOn;
    viewer.front.classList.toggle("sketching", this.isOn);
    viewer.tool = this.isOn ? this.tool : null;
    this.studio.welcome.hidden = this.isOn || this.studio.hasDrawing;
    const disable = (/** @type {string} */ id, /** @type {boolean} */ is) => (/** @type {HTMLButtonElement} */ (byId(id)).disabled = is);
    disable("undo", this.strokes.length === 0);
    disable("redo", this.undone.length === 0);
    disable("clear", this.strokes.length === 0);
    viewer.draw();
  }

  undo() {
    const stroke = this.strokes.pop();
    if (!stroke) return;
    this.undone.push(stroke);
    this.studio.viewer.say("stroke taken back");
    this.changed();
  }

  redo() {
    const stroke = this.undone.pop();
    if (!stroke) return;
    this.strokes.push(stroke);
    this.changed();
  }

  /** Plans the sketch as it is now. */
  async changed() {
    const { studio } = this;
    studio.state.sketch = this.strokes;
    this.show();
    if (this.strokes.length === 0) {
      studio.compiler.file = null;
      studio.state.file = null;
      studio.outline = null;
      byId("facts").replaceChildren();
      return studio.changed(false);
    }
    const [x0, y0, x1, y1] = studio.viewer.meta.machine.sheet_mm;
    const svg = svgOf(this.strokes, x1 - x0, y1 - y0, Number(studio.state.smooth) || 0);
    const bytes = new TextEncoder().encode(svg);
    studio.state.file = { name: NAME, base64: toBase64(bytes) };
    studio.compiler.open(NAME, bytes);
    studio.isFresh = true;
    await studio.changed(false, true);
  }

  /** A place on the sheet, mm from its lower-left corner. @param {[number, number]} at @returns {[number, number]} */
  onSheet([x, y]) {
    const [x0, y0, x1, y1] = this.studio.viewer.meta.machine.sheet_mm;
    const inside = (/** @type {number} */ value, /** @type {number} */ most) => Number(Math.min(Math.max(value, 0), most).toFixed(3));
    return [inside(x - x0, x1 - x0), inside(y - y0, y1 - y0)];
  }

  /** @returns {import("../viewer/js/viewer.js").Tool} */
  get tool() {
    return {
      down: (at, event) => {
        if (event.button !== 0) return false;
        this.current = { pen: Number(/** @type {HTMLSelectElement} */ (byId("sketch-pen")).value), points: this.onSheet(at) };
        return true;
      },
      move: (_, event) => {
        const box = this.studio.viewer.front.getBoundingClientRect();
        // Between two frames a pen reports many positions.
        const events = event.getCoalescedEvents?.() ?? [];
        for (const { clientX, clientY } of events.length > 0 ? events : [event]) {
          const at = this.studio.viewer.place({ x: clientX - box.left, y: clientY - box.top });
          this.current?.points.push(...this.onSheet(at));
        }
      },
      up: () => {
        if (!this.current) return;
        this.strokes.push(this.current);
        this.undone = [];
        this.current = null;
        this.changed();
      },
      cancel: () => (this.current = null),
      hover() {},
      key: () => false,
      draw: (context, picture) => {
        this.studio.placer.drawBeyond(context, picture);
        if (!this.current) return;
        const { pen, points } = this.current;
        const [x0, y0] = picture.meta.machine.sheet_mm;
        context.strokeStyle = PENS[pen][1];
        context.lineWidth = picture.wide(0.5, 1.5);
        context.beginPath();
        for (let k = 0; k < points.length; k += 2) context.lineTo(x0 + points[k], y0 + points[k + 1]);
        context.stroke();
      },
    };
  }
}
