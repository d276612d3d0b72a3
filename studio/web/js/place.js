// Where the drawing lies: buttons, number fields, and by hand on the sheet.

import { byId, element } from "../viewer/js/dom.js";

/** Handles take the pointer within this distance, CSS pixels. */
const GRAB_PX = 16;
/** The knob that turns the drawing stands this far above it, CSS pixels. */
const KNOB_PX = 28;

/**
 * The ink's lower-left corner from that of the sheet, mm; scale; degrees counterclockwise.
 * @typedef {{x: number, y: number, scale: number, degrees: number}} Place
 * @typedef {import("./outline.js").Affine} Affine
 */

/** @param {number} value @param {number} digits */
function rounded(value, digits) {
  return Number(value.toFixed(digits));
}

/** What the search for the best place found. @param {any} found */
function bestText({ duration_s, centered_duration_s, quantization_error_mm, centered_quantization_error_mm, compared }) {
  const [figure, middle, unit] = duration_s === null ? [quantization_error_mm, centered_quantization_error_mm, "mm"] : [duration_s, centered_duration_s, "s"];
  const digits = unit === "mm" ? 3 : 2;
  const of = middle === null ? "in the middle of the sheet it cannot be drawn" : `${middle.toFixed(digits)} ${unit} in the middle of the sheet`;
  return `${figure.toFixed(digits)} ${unit}; ${of}. ${compared} places were compared.`;
}

export class Placer {
  /** @param {import("./studio.js").Studio} studio */
  constructor(studio) {
    this.studio = studio;
    /** What the search for the best place found. @type {any} */
    this.found = null;
    /** @type {Affine | null} the last plan's */
    this.placement = null;
    /** @type {number[][]} */
    this.beyond = [];
    this.isOn = false;
    /** @type {{kind: "move" | "scale" | "turn", from: [number, number], place: Place, box: number[], at: Place} | null} */
    this.drag = null;
    const press = (/** @type {string} */ id, /** @type {() => void} */ action) => byId(id).addEventListener("click", action);
    press("place-fit", () => this.choose({ fit: true }));
    press("place-center", () => this.choose({ align: "center" }));
    press("place-origin", () => this.choose({}, true));
    press("place-time", () => this.best("time"));
    press("place-accuracy", () => this.best("accuracy"));
    press("by-hand", () => (this.isOn ? this.end() : this.begin()));
    for (const id of ["x", "y", "scale", "rotate"]) {
      const field = this.field(id);
      field.addEventListener("input", () => this.typed(id, true));
      field.addEventListener("change", () => this.typed(id, false));
    }
    const margin = this.field("margin");
    margin.addEventListener("input", () => this.option("margin", margin.value === "" ? "" : `${margin.value}mm`, true));
    margin.addEventListener("change", () => this.studio.changed(false));
    const mirror = /** @type {HTMLSelectElement} */ (byId("mirror"));
    mirror.addEventListener("change", () => this.option("mirror", mirror.value, false));
  }

  /** @param {string} id */
  field(id) {
    return /** @type {HTMLInputElement} */ (byId(id));
  }

  get options() {
    return this.studio.state.options;
  }

  /** @param {"margin" | "mirror"} name @param {string} value @param {boolean} isDraft */
  option(name, value, isDraft) {
    this.options[name] = value;
    this.studio.changed(isDraft);
  }

  /** Fit, centre, or the file's own place. @param {{fit?: boolean, align?: string}} how @param {boolean} isOwnSize */
  choose({ fit = false, align = "" }, isOwnSize = false) {
    Object.assign(this.options, { fit, align, place: "", for: "" });
    if (fit || isOwnSize) this.options.scale = "";
    if (isOwnSize) Object.assign(this.options, { rotate: "", mirror: "" });
    this.studio.changed(false);
  }

  /** Searches for the best place, and turn. @param {string} aim */
  best(aim) {
    Object.assign(this.options, { fit: false, align: "", place: "best", for: aim === "time" ? "" : aim, rotate: "" });
    this.studio.showFields();
    this.studio.changed(false);
  }

  /** Buttons that make a drawing out of reach fit. */
  remedies() {
    const center = element("button", { type: "button" }, "Centre");
    center.addEventListener("click", () => this.choose({ align: "center" }));
    const fit = element("button", { type: "button" }, "Fit");
    fit.addEventListener("click", () => this.choose({ fit: true }));
    return element("div", { class: "row" }, center, fit);
  }

  get sheet() {
    return this.studio.viewer.meta.machine.sheet_mm;
  }

  /** The place of the last plan. @returns {Place | null} */
  get place() {
    const { placement } = this;
    const { outline } = this.studio;
    if (!placement || !outline?.bounds) return null;
    const [a, b, c, d, e, f] = placement;
    const box = outline.box(a, b, c, d);
    const [x0, y0] = this.sheet;
    return { x: box[0] + e - x0, y: box[1] + f - y0, scale: Math.hypot(a, b), degrees: this.degrees };
  }

  get degrees() {
    if (this.options.place === "best") return this.found?.rotate_deg ?? 0;
    return Number(this.options.rotate) || 0;
  }

  /** The linear map of a place. @param {Place} place @returns {[number, number, number, number]} */
  linear({ scale, degrees }) {
    const [sin, cos] = [Math.sin((degrees * Math.PI) / 180) * scale, Math.cos((degrees * Math.PI) / 180) * scale];
    const [mx, my] = [this.options.mirror === "x" ? -1 : 1, this.options.mirror === "y" ? -1 : 1];
    return [cos * mx, sin * mx, -sin * my, cos * my];
  }

  /** The ink's box of a place, machine mm. @param {Place} place */
  box(place) {
    const { outline } = this.studio;
    if (!outline) return [0, 0, 0, 0];
    const [bx0, by0, bx1, by1] = outline.box(...this.linear(place));
    const [x0, y0] = [this.sheet[0] + place.x, this.sheet[1] + place.y];
    return [x0, y0, x0 + bx1 - bx0, y0 + by1 - by0];
  }

  /** Takes a place as options of the command line. @param {Place} place @param {boolean} isDraft */
  take(place, isDraft) {
    const bounds = this.studio.outline?.bounds;
    if (!bounds) return;
    const scale = rounded(place.scale, 4);
    const [x, y] = [rounded(place.x - scale * bounds[0], 2), rounded(place.y - scale * bounds[1], 2)];
    const degrees = rounded(place.degrees, 1);
    Object.assign(this.options, {
      fit: false,
      align: "",
      place: `${x}mm,${y}mm`,
      for: "",
      scale: scale === 1 ? "" : String(scale),
      rotate: degrees === 0 ? "" : String(degrees),
    });
    this.showFields(place);
    this.studio.changed(isDraft);
  }

  /** A number was typed. @param {string} id @param {boolean} isDraft */
  typed(id, isDraft) {
    const value = Number(this.field(id).value);
    const { place } = this;
    if (this.field(id).value === "" || !Number.isFinite(value)) return;
    if (id === "rotate" && (this.options.fit || this.options.align)) {
      this.options.rotate = value === 0 ? "" : String(value);
      return this.studio.changed(isDraft);
    }
    if (!place) return;
    if (id === "x") place.x = value;
    else if (id === "y") place.y = value;
    else if (id === "rotate") place.degrees = value;
    else if (value > 0) place.scale = value / 100;
    this.take(place, isDraft);
  }

  /** A plan came. @param {any} json @param {boolean} isDraft */
  planned(json, isDraft) {
    this.placement = json.placement ?? null;
    this.beyond = json.beyond_mm ?? [];
    this.beyondSheet = json.beyond_sheet_mm ?? 0;
    if (!isDraft) this.found = json.best_place ?? null;
    if (!isDraft || !this.drag) this.showPlace();
    this.studio.viewer.tool = this.isOn ? this.tool : this.studio.sketch.isOn ? this.studio.sketch.tool : this.beyond.length > 0 ? this.idle : null;
  }

  /** Shows the last plan's place. */
  showPlace() {
    const { fit, align, place, for: aim } = this.options;
    const pressed = {
      "place-fit": fit, "place-center": align === "center", "place-origin": !fit && align === "" && place === "",
      "place-time": place === "best" && aim !== "accuracy", "place-accuracy": place === "best" && aim === "accuracy",
    };
    for (const [id, on] of Object.entries(pressed)) byId(id).setAttribute("aria-pressed", String(on));
    /** @type {HTMLButtonElement} */ (byId("by-hand")).disabled = !this.place;
    if (this.place) this.showFields(this.place);
    else for (const id of ["x", "y", "scale"]) this.field(id).value = "";
    if (document.activeElement !== this.field("rotate")) this.field("rotate").value = String(this.degrees);
    if (document.activeElement !== this.field("margin")) this.field("margin").value = this.options.margin.replace(/mm$/, "");
    /** @type {HTMLSelectElement} */ (byId("mirror")).value = this.options.mirror;
    byId("place-state").textContent = place === "best" && this.found ? bestText(this.found) : this.beyondSheet > 1e-6 ? `Ink reaches ${this.beyondSheet?.toFixed(2)} mm beyond the sheet; the machine can draw there.` : "";
  }

  /** @param {Place} place */
  showFields(place) {
    const texts = { x: place.x.toFixed(2), y: place.y.toFixed(2), scale: (100 * place.scale).toFixed(2), rotate: String(rounded(place.degrees, 1)) };
    for (const [id, text] of Object.entries(texts)) if (document.activeElement !== this.field(id)) this.field(id).value = String(Number(text));
  }

  begin() {
    this.studio.sketch.pause();
    this.isOn = true;
    this.show();
    this.studio.viewer.front.focus();
  }

  end() {
    this.isOn = false;
    this.drag = null;
    this.show();
  }

  show() {
    const { viewer } = this.studio;
    byId("by-hand").setAttribute("aria-pressed", String(this.isOn));
    viewer.front.classList.toggle("placing", this.isOn);
    viewer.tool = this.isOn ? this.tool : this.beyond.length > 0 ? this.idle : null;
    viewer.draw();
  }

  /** The corners and the knob of a box, machine mm. @param {number[]} box @returns {[number, number][]} */
  handles([x0, y0, x1, y1]) {
    const knob = y1 + KNOB_PX / this.studio.viewer.picture.scale;
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1], [(x0 + x1) / 2, knob]];
  }

  /** Index of the handle at a place; -1 for the inside, -2 for none. @param {number[]} box @param {[number, number]} at */
  hit(box, [x, y]) {
    const { scale } = this.studio.viewer.picture;
    const near = this.handles(box).findIndex(([hx, hy]) => Math.hypot(hx - x, hy - y) * scale <= GRAB_PX);
    if (near >= 0) return near;
    const margin = 6 / scale;
    const isInside = x >= box[0] - margin && x <= box[2] + margin && y >= box[1] - margin && y <= box[3] + margin;
    return isInside ? -1 : -2;
  }

  /** What the drag makes of the place. @param {[number, number]} at @returns {Place} */
  dragged([x, y]) {
    const { drag } = this;
    if (!drag) throw new Error("nothing is dragged");
    const { place, box, from } = drag;
    if (drag.kind === "move") return { ...place, x: place.x + x - from[0], y: place.y + y - from[1] };
    const center = [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2];
    if (drag.kind === "turn") {
      const angle = Math.atan2(x - center[0], y - center[1]) - Math.atan2(from[0] - center[0], from[1] - center[1]);
      let degrees = place.degrees - (angle * 180) / Math.PI;
      // Quarters of a turn hold the drawing.
      const quarter = Math.round(degrees / 90) * 90;
      if (Math.abs(degrees - quarter) < 2) degrees = quarter;
      degrees = ((degrees + 540) % 360) - 180;
      const turned = { ...place, degrees };
      const after = this.box(turned);
      return { ...turned, x: place.x + center[0] - (after[0] + after[2]) / 2, y: place.y + center[1] - (after[1] + after[3]) / 2 };
    }
    // About the opposite corner.
    const fixed = [from[0] < center[0] ? box[2] : box[0], from[1] < center[1] ? box[3] : box[1]];
    const before = Math.hypot(from[0] - fixed[0], from[1] - fixed[1]);
    const factor = Math.max(Math.hypot(x - fixed[0], y - fixed[1]) / Math.max(before, 1e-6), 0.01);
    const [sx, sy] = this.sheet;
    return {
      ...place,
      scale: place.scale * factor,
      x: fixed[0] + factor * (box[0] - fixed[0]) - sx,
      y: fixed[1] + factor * (box[1] - fixed[1]) - sy,
    };
  }

  /** Shows what is out of reach, and leaves the pointer to the picture. @returns {import("../viewer/js/viewer.js").Tool} */
  get idle() {
    return {
      down: () => false, move() {}, up() {}, cancel() {}, hover() {}, key: () => false,
      draw: (context, picture) => this.drawBeyond(context, picture),
    };
  }

  /** @returns {import("../viewer/js/viewer.js").Tool} */
  get tool() {
    return {
      down: (at) => {
        const { place } = this;
        if (!place) return false;
        const box = this.box(place);
        const handle = this.hit(box, at);
        if (handle === -2) return false;
        const kind = handle === -1 ? "move" : handle === 4 ? "turn" : "scale";
        this.drag = { kind, from: at, place, box, at: place };
        return true;
      },
      move: (at) => {
        if (!this.drag) return;
        this.drag.at = this.dragged(at);
        this.take(this.drag.at, true);
      },
      up: (at) => {
        if (!this.drag) return;
        const place = this.dragged(at);
        this.drag = null;
        this.take(place, false);
      },
      cancel: () => (this.drag = null),
      hover: (at, front) => {
        const handle = this.place ? this.hit(this.box(this.place), at) : -2;
        front.title = handle === 4 ? "Turn" : handle >= 0 ? "Scale" : "";
      },
      key: (key, isShifted) => {
        /** @type {Record<string, [number, number]>} */
        const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
        const { place } = this;
        if (key === "Escape") this.end();
        else if (steps[key] && place) {
          const step = isShifted ? 0.1 : 1;
          this.take({ ...place, x: place.x + step * steps[key][0], y: place.y + step * steps[key][1] }, false);
        } else return false;
        return true;
      },
      draw: (context, picture) => this.draw(context, picture),
    };
  }

  /** Ink out of reach, red. @param {CanvasRenderingContext2D} context @param {import("../viewer/js/picture.js").Picture} picture */
  drawBeyond(context, picture) {
    const { outline } = this.studio;
    if (this.beyond.length === 0 || !outline || !this.placement) return;
    context.strokeStyle = picture.theme.machine;
    context.lineWidth = picture.wide(0, 1.2);
    context.stroke(outline.path(this.placement));
    context.strokeStyle = picture.theme.limit;
    context.lineWidth = picture.wide(0, 3);
    for (const line of this.beyond) {
      context.beginPath();
      for (let k = 0; k < line.length; k += 2) context.lineTo(line[k], line[k + 1]);
      context.stroke();
    }
  }

  /** @param {CanvasRenderingContext2D} context @param {import("../viewer/js/picture.js").Picture} picture */
  draw(context, picture) {
    this.drawBeyond(context, picture);
    const place = this.drag?.at ?? this.place;
    const { outline } = this.studio;
    if (!place || !outline) return;
    const box = this.box(place);
    context.strokeStyle = picture.theme.select;
    context.lineWidth = picture.wide(0, 1.4);
    if (this.drag) {
      const linear = this.linear(place);
      const [bx0, by0] = outline.box(...linear);
      context.stroke(outline.path([...linear, box[0] - bx0, box[1] - by0]));
    }
    context.setLineDash([6 / picture.scale, 4 / picture.scale]);
    context.strokeRect(box[0], box[1], box[2] - box[0], box[3] - box[1]);
    context.setLineDash([]);
    const handles = this.handles(box);
    context.beginPath();
    context.moveTo(handles[4][0], box[3]);
    context.lineTo(...handles[4]);
    context.stroke();
    handles.forEach(([x, y], k) => {
      context.beginPath();
      const size = 5.5 / picture.scale;
      if (k === 4) context.arc(x, y, size, 0, 2 * Math.PI);
      else context.rect(x - size, y - size, 2 * size, 2 * size);
      context.fillStyle = picture.theme.panel;
      context.fill();
      context.stroke();
    });
  }
}
