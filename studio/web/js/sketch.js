// Sketching on the sheet with mouse, finger or pen. The sketch is an SVG drawing of the sheet's size.

import { byId } from "../viewer/js/dom.js";
import { corners, isLarge, mapped } from "./area.js";
import { smooth } from "./smooth.js";
import { toBase64 } from "./state.js";

/** The pens: name and colour. @type {Record<number, [string, string]>} */
const PENS = { 1: ["black", "#1c1c1c"], 2: ["red", "#c03028"], 3: ["green", "#1f7a3a"], 4: ["blue", "#2050a8"] };
/** What the two corners of the area are on the sheet. */
const AREA_FIELDS = ["area-x0", "area-y0", "area-x1", "area-y1"];
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
    /** The current stroke as the pointer goes, CSS pixels of the picture; with an area it is elsewhere on the sheet. @type {number[]} */
    this.trace = [];
    /** Corners of the area that were pressed, CSS pixels; null outside the calibration. @type {number[] | null} */
    this.pressed = null;
    byId("area-begin").addEventListener("click", () => {
      this.pressed = this.pressed ? null : [];
      this.show();
    });
    byId("area-end").addEventListener("click", () => this.setArea(null));
    AREA_FIELDS.forEach((id, k) => {
      const field = /** @type {HTMLInputElement} */ (byId(id));
      field.addEventListener("change", () => {
        const { area } = this.studio.state;
        if (!area || field.value === "") return;
        const sheet = [...area.sheet];
        sheet[k] = Number(field.value);
        this.setArea({ ...area, sheet });
      });
    });
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
    Object.assign(this.studio.state.options, { fit: false, align: "", place: "", for: "", scale: "", rotate: "", mirror: "", page: "", pens: "", copies: "", only_pens: "" });
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
    this.pressed = null;
    this.show();
  }

  /** @param {import("./area.js").Area | null} area */
  setArea(area) {
    this.pressed = null;
    this.studio.state.area = area;
    this.studio.remember();
    this.show();
  }

  /** A corner of the area was pressed. @param {[number, number]} corner CSS pixels */
  press(corner) {
    this.pressed?.push(...corner);
    const { pressed } = this;
    if (!pressed || pressed.length < 4) return this.show();
    if (!isLarge(pressed)) {
      this.pressed = pressed.slice(0, 2);
      this.show();
      byId("area-state").textContent = "The corners are too near to each other: press the opposite corner.";
      return;
    }
    const [x0, y0, x1, y1] = this.studio.viewer.meta.machine.sheet_mm;
    this.setArea({ pad: pressed, sheet: corners(pressed, x1 - x0, y1 - y0).map((mm) => Number(mm.toFixed(3))) });
  }

  /** Shows the area's fields and what is to be done. */
  showArea() {
    const { area } = this.studio.state;
    byId("area-fields").hidden = !area;
    byId("area-end").hidden = !area;
    byId("area-begin").setAttribute("aria-pressed", String(this.pressed !== null));
    AREA_FIELDS.forEach((id, k) => {
      const field = /** @type {HTMLInputElement} */ (byId(id));
      if (area && document.activeElement !== field) field.value = String(area.sheet[k]);
    });
    const asked = this.pressed && (this.pressed.length < 2 ? "Press one corner of the area you draw on." : "Press the opposite corner.");
    byId("area-state").textContent = asked ?? (area ? "What you draw in the area is drawn between these two points of the sheet." : "");
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
    byId("add").hidden = this.isOn || !this.studio.hasDrawing;
    if (!this.studio.hasDrawing) for (const id of ["pens-field", "page-field", "svg-fields"]) byId(id).hidden = true;
    this.showArea();
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
      this.show();
      return studio.changed(false);
    }
    const [x0, y0, x1, y1] = studio.viewer.meta.machine.sheet_mm;
    const svg = svgOf(this.strokes, x1 - x0, y1 - y0, Number(studio.state.smooth) || 0);
    const bytes = new TextEncoder().encode(svg);
    studio.state.file = { name: NAME, base64: toBase64(bytes) };
    studio.state.others = [];
    studio.compiler.open([{ name: NAME, bytes }]);
    studio.isFresh = true;
    await studio.changed(false, true);
  }

  /** Where an event is in the picture, CSS pixels. @param {{clientX: number, clientY: number}} event @returns {[number, number]} */
  inPicture({ clientX, clientY }) {
    const box = this.studio.viewer.front.getBoundingClientRect();
    return [clientX - box.left, clientY - box.top];
  }

  /** Where an event is on the sheet, mm from its lower-left corner. @param {{clientX: number, clientY: number}} event @returns {[number, number]} */
  onSheet(event) {
    const [px, py] = this.inPicture(event);
    const [x0, y0, x1, y1] = this.studio.viewer.meta.machine.sheet_mm;
    const { area } = this.studio.state;
    const [x, y] = area ? mapped(area, px, py).map((mm, k) => mm + [x0, y0][k]) : this.studio.viewer.place({ x: px, y: py });
    const inside = (/** @type {number} */ value, /** @type {number} */ most) => Number(Math.min(Math.max(value, 0), most).toFixed(3));
    return [inside(x - x0, x1 - x0), inside(y - y0, y1 - y0)];
  }

  /** @returns {import("../viewer/js/viewer.js").Tool} */
  get tool() {
    return {
      down: (_, event) => {
        if (event.button !== 0) return false;
        if (this.pressed) {
          this.press(this.inPicture(event));
          return true;
        }
        this.current = { pen: Number(/** @type {HTMLSelectElement} */ (byId("sketch-pen")).value), points: this.onSheet(event) };
        this.trace = this.inPicture(event);
        return true;
      },
      move: (_, event) => {
        if (!this.current) return;
        // Between two frames a pen reports many positions.
        const events = event.getCoalescedEvents?.() ?? [];
        for (const one of events.length > 0 ? events : [event]) {
          this.current.points.push(...this.onSheet(one));
          this.trace.push(...this.inPicture(one));
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
        this.drawArea(context, picture);
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

  /** The area of the pad, its corners, and the pointer's way in it. @param {CanvasRenderingContext2D} context @param {import("../viewer/js/picture.js").Picture} picture */
  drawArea(context, picture) {
    const { viewer, state } = this.studio;
    const at = (/** @type {number[]} */ four, /** @type {number} */ k) => viewer.place({ x: four[k], y: four[k + 1] });
    const points = this.pressed ?? state.area?.pad ?? [];
    context.strokeStyle = picture.theme.select;
    context.lineWidth = picture.wide(0, 1.4);
    if (points.length === 4) {
      const [[x0, y0], [x1, y1]] = [at(points, 0), at(points, 2)];
      context.setLineDash([6 / picture.scale, 4 / picture.scale]);
      context.strokeRect(Math.min(x0, x1), Math.min(y0, y1), Math.abs(x1 - x0), Math.abs(y1 - y0));
      context.setLineDash([]);
    }
    const arm = 7 / picture.scale;
    for (let k = 0; k + 1 < points.length; k += 2) {
      const [x, y] = at(points, k);
      context.beginPath();
      context.moveTo(x - arm, y);
      context.lineTo(x + arm, y);
      context.moveTo(x, y - arm);
      context.lineTo(x, y + arm);
      context.stroke();
    }
    if (!this.current || !state.area) return;
    context.globalAlpha = 0.5;
    context.beginPath();
    for (let k = 0; k < this.trace.length; k += 2) context.lineTo(...at(this.trace, k));
    context.stroke();
    context.globalAlpha = 1;
  }
}
