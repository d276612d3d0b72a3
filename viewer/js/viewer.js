// The viewer: a plan, a time, and everything that shows them.

import { unpack } from "./columns.js";
import { KINDS, LEVELS, SCALE, viridis } from "./colors.js";
import { byId, element, ramp, swatch, tabs } from "./dom.js";
import { plural, short, time, whole } from "./format.js";
import { pen as penOf } from "./machine.js";
import { messagesPanel, planPanel, strokePanel } from "./panels.js";
import { Picture } from "./picture.js";
import { binding, limits, motion, motorsAt, rowAt, strokeAt, track } from "./plan.js";
import { Scrubber } from "./scrubber.js";
import { Source } from "./source.js";
import { Strips, stripsOf } from "./strips.js";

/** Speeds of playing. */
const RATES = [0.25, 0.5, 1, 2, 5, 10, 25, 50, 100];
/** Paths of the play button's shape. */
const SHAPES = { play: "M4 2v12l10-6z", pause: "M3 2h4v12H3zM9 2h4v12H9z" };

/**
 * What takes the pointer on the picture, machine mm: the studio places and sketches with it.
 * @typedef {object} Tool
 * @property {(at: [number, number], event: PointerEvent) => boolean} down  whether it takes this drag
 * @property {(at: [number, number], event: PointerEvent) => void} move
 * @property {(at: [number, number], event: PointerEvent) => void} up
 * @property {() => void} cancel
 * @property {(at: [number, number], front: HTMLElement) => void} hover
 * @property {(key: string, isShifted: boolean) => boolean} key  whether it takes the key on the picture
 * @property {(context: CanvasRenderingContext2D, picture: Picture) => void} draw  over all else
 */

export class Viewer {
  /** @param {any} meta @param {Uint8Array} bytes the columns, inflated */
  constructor(meta, bytes) {
    this.t = 0;
    this.row = 0;
    this.rate = 1;
    this.end = 0;
    this.isPlaying = false;
    this.isDrawing = false;
    this.selected = -1;
    /** @type {Tool | null} What takes the pointer on the picture instead of moving it. */
    this.tool = null;
    /** @type {import("./plan.js").Limit[] | null} */
    this.limits = null;
    /** @type {any} */
    this.meta = meta;
    /** @type {import("./plan.js").Track} */
    this.rows;
    /** @type {import("./plan.js").Track | null} */
    this.predicted;
    /** @type {Float64Array | null} */
    this.deviation;
    /** @type {import("./plan.js").Motion | null} */
    this.motion;
    /** @type {Strips | null} */
    this.strips;
    /** @type {Source} */
    this.source;
    /** @type {Picture} */
    this.picture;
    const canvas = (/** @type {string} */ id) => /** @type {HTMLCanvasElement} */ (byId(id));
    this.stage = byId("stage");
    this.front = canvas("front");
    this.canvases = { base: canvas("base"), ink: canvas("ink"), front: this.front };
    this.scrubber = new Scrubber(byId("scrubber"), canvas("bands"), byId("head"), byId("window"), (t) => this.seek(t));
    this.openTab = tabs(byId("tab-plan").parentElement ?? document.body, () => this.source.reveal());
    this.show(meta, bytes, false);
    this.listen();
    new ResizeObserver(() => {
      this.picture.resize(this.stage.clientWidth, this.stage.clientHeight);
      this.draw();
    }).observe(this.stage);
    this.fromHash();
    this.draw();
  }

  /**
   * Shows a plan, in place of the one before: time, view and colours stay. A draft has no diagrams.
   * @param {any} meta @param {Uint8Array} bytes the columns, inflated @param {boolean} isDraft
   */
  show(meta, bytes, isDraft) {
    const wasAtEnd = this.end > 0 && this.t >= this.end;
    this.meta = meta;
    const { numbers, texts } = unpack(bytes, meta.columns);
    const column = (/** @type {string} */ name) => numbers.get(name) ?? new Float64Array(0);
    const position = penOf(meta.machine);
    const seconds = (/** @type {Float64Array} */ us) => us.map((t) => t * 1e-6);
    const ticks = (/** @type {string} */ name, /** @type {number} */ k) => column(name).map((value) => value * meta.tick_units[k]);
    const [playA, playB] = meta.machine.motors.map((/** @type {any} */ motor) => motor.backlash ?? 0);
    this.rows = track(
      seconds(column("t")), column("pen"), [ticks("a", 0), ticks("b", 1)], position, [column("off_a"), column("off_b")],
      [playA, playB],
    );
    this.predicted = numbers.has("predicted_t")
      ? track(seconds(column("predicted_t")), column("predicted_pen"), [ticks("predicted_a", 0), ticks("predicted_b", 1)], position, null, [0, 0])
      : null;
    this.deviation = numbers.get("deviation") ?? null;
    this.end = this.rows.t[this.rows.t.length - 1];
    if (this.predicted) this.end = Math.max(this.end, this.predicted.t[this.predicted.t.length - 1]);
    this.t = wasAtEnd ? this.end : Math.min(this.t, this.end);
    this.source = new Source(meta, numbers, texts);
    this.motion = null;
    this.limits = null;
    this.selected = -1;
    this.picture = new Picture(this.canvases, meta, this.rows, this.predicted, this.picture ?? null);
    this.scrubber.show(this.rows, (number) => this.picture.pens.get(number)?.color ?? "#000000", this.end);
    if (!isDraft) {
      // The picture first: speeds and strips follow when it is on the screen. Those of the plan before stay
      // until then, so that the page keeps its layout.
      const { rows } = this;
      requestAnimationFrame(() => setTimeout(() => rows === this.rows && this.addMotion(), 0));
    }
    this.showTexts();
    this.draw();
  }

  addMotion() {
    this.strips?.remove();
    this.strips = null;
    // A machine that stands has no motion.
    if (this.rows.t.length > 1) this.showMotion();
    document.documentElement.dataset.ready = "true";
  }

  showMotion() {
    this.motion = motion(this.meta, this.rows);
    this.limits = limits(this.meta, this.rows, this.motion);
    this.strips = new Strips(byId("strips"), this.rows.t, stripsOf(this.meta, this.rows, this.motion), {
      seek: (t) => this.seek(t),
      hover: (t) => this.hover(t),
      windowChanged: (t0, t1) => this.scrubber.showWindow(t0, t1),
    });
    this.strips.setHead(this.t, false);
    if (this.colorBy !== "pen") this.setColor(this.colorBy ?? "pen");
    if (this.selected >= 0) this.select(this.selected, this.selectedRow ?? 0);
  }

  /** The limit that binds at a row: its index from 1, or 0. @param {number} row */
  binds(row) {
    return this.limits ? binding(this.limits, row) : 0;
  }

  showTexts() {
    const { meta } = this;
    byId("title").textContent = meta.title;
    const drawn = this.end > 0 ? `, ${time(this.end)}, ${plural(this.rows.first.length, "stroke")}` : "";
    byId("subtitle").textContent = `${meta.subtitle}${drawn}`;
    const verdict = byId("verdict");
    const holds = meta.certificate?.holds;
    verdict.hidden = holds === undefined;
    verdict.classList.remove("good", "bad");
    verdict.textContent = holds ? (meta.certificate.after_rounding ? "Certificate holds" : "Motion holds") : "Certificate does not hold";
    verdict.classList.add(holds ? "good" : "bad");
    planPanel(byId("panel-plan"), meta, this.rows);
    strokePanel(byId("panel-stroke"), this, -1, 0);
    messagesPanel(byId("panel-messages"), this);
    const count = meta.diagnostics.length;
    byId("tab-messages").textContent = count > 0 ? `Messages (${count})` : "Messages";
    const byDeviation = /** @type {HTMLOptionElement} */ (byId("color").querySelector('[value="deviation"]'));
    byDeviation.hidden = !this.deviation;
    byDeviation.disabled = !this.deviation;
    byId("predicted-field").hidden = !this.predicted;
    this.front.setAttribute("aria-label", `${meta.title}, ${meta.subtitle}: picture of the machine and the ink. Arrow keys move it, plus and minus zoom, F fits.`);
  }

  listen() {
    const click = (/** @type {string} */ id, /** @type {() => void} */ action) => byId(id).addEventListener("click", action);
    click("play", () => this.toggle());
    click("to-start", () => this.seek(0));
    click("to-end", () => this.seek(this.end));
    click("previous", () => this.step(-1));
    click("next", () => this.step(1));
    click("zoom-in", () => this.zoom(1.4));
    click("zoom-out", () => this.zoom(1 / 1.4));
    click("fit", () => this.fit());
    click("measure", () => this.setMeasuring(!this.isMeasuring));
    const rate = /** @type {HTMLSelectElement} */ (byId("rate"));
    rate.addEventListener("change", () => (this.rate = Number(rate.value)));
    const color = /** @type {HTMLSelectElement} */ (byId("color"));
    color.addEventListener("change", () => this.setColor(color.value));
    for (const name of /** @type {const} */ (["machine", "travel", "ahead", "reach", "predicted"])) {
      const box = /** @type {HTMLInputElement} */ (byId(`show-${name}`));
      box.addEventListener("change", () => {
        this.picture.shows[name] = box.checked;
        this.picture.stale = true;
        this.draw();
      });
    }
    document.addEventListener("pointerdown", (event) => {
      const menu = /** @type {HTMLDetailsElement} */ (byId("layers"));
      if (menu.open && !menu.contains(/** @type {Node} */ (event.target))) menu.open = false;
    });
    this.listenToPicture();
    document.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("hashchange", () => this.fromHash());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.picture.retheme();
      this.strips?.retheme();
      this.scrubber.draw();
      this.draw();
    });
  }

  listenToPicture() {
    const { front } = this;
    /** @type {Map<number, {x: number, y: number}>} */
    const pointers = new Map();
    let moved = 0;
    let isToolUsed = false;
    const at = (/** @type {MouseEvent} */ event) => {
      const box = front.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    front.addEventListener("pointerdown", (event) => {
      front.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, at(event));
      moved = 0;
      if (pointers.size > 1) {
        // Two fingers zoom, also while a tool is in use.
        this.tool?.cancel();
        isToolUsed = false;
      } else if (this.tool) {
        isToolUsed = this.tool.down(this.place(at(event)), event);
        if (isToolUsed) return this.draw();
      }
      if (this.isMeasuring) {
        const [x, y] = this.picture.toMachine(at(event).x, at(event).y);
        this.picture.measured = [x, y, x, y];
      }
      front.classList.add("dragging");
    });
    front.addEventListener("pointermove", (event) => {
      const here = at(event);
      const before = pointers.get(event.pointerId);
      if (!before) this.tool?.hover(this.place(here), front);
      if (!before) return this.showPlace(here);
      if (isToolUsed) {
        this.tool?.move(this.place(here), event);
        this.showPlace(here);
        return this.draw();
      }
      pointers.set(event.pointerId, here);
      const [dx, dy] = [here.x - before.x, here.y - before.y];
      moved += Math.abs(dx) + Math.abs(dy);
      if (pointers.size === 2) {
        const [one, two] = [...pointers.values()];
        const other = one === here ? two : one;
        const [old, now] = [Math.hypot(before.x - other.x, before.y - other.y), Math.hypot(here.x - other.x, here.y - other.y)];
        if (old > 1) this.picture.zoom(now / old, (here.x + other.x) / 2, (here.y + other.y) / 2);
        this.picture.pan(dx / 2, dy / 2);
      } else if (this.isMeasuring && this.picture.measured) {
        const [x, y] = this.picture.toMachine(here.x, here.y);
        this.picture.measured = [this.picture.measured[0], this.picture.measured[1], x, y];
        this.showMeasured();
      } else if (moved > 3) {
        this.picture.pan(dx, dy);
      }
      this.draw();
    });
    const end = (/** @type {PointerEvent} */ event) => {
      const here = pointers.get(event.pointerId);
      pointers.delete(event.pointerId);
      if (isToolUsed && pointers.size === 0) {
        isToolUsed = false;
        front.classList.remove("dragging");
        if (event.type === "pointerup") this.tool?.up(this.place(at(event)), event);
        else this.tool?.cancel();
        return this.draw();
      }
      if (pointers.size === 0) front.classList.remove("dragging");
      if (event.type === "pointerup" && here && moved <= 3 && !this.isMeasuring) this.pick(here.x, here.y);
    };
    front.addEventListener("pointerup", end);
    front.addEventListener("pointercancel", end);
    front.addEventListener("pointerleave", () => this.isMeasuring || (byId("readout").textContent = ""));
    front.addEventListener("wheel", (event) => {
      event.preventDefault();
      const { x, y } = at(event);
      this.picture.zoom(Math.exp(-event.deltaY * 0.0015), x, y);
      this.draw();
    }, { passive: false });
    front.addEventListener("dblclick", () => this.isMeasuring || this.tool || this.fit());
  }

  /** @param {number} factor */
  zoom(factor) {
    this.picture.zoom(factor);
    this.draw();
  }

  fit() {
    this.picture.fit();
    this.draw();
  }

  /** A place on the stage in machine mm. @param {{x: number, y: number}} place */
  place({ x, y }) {
    return this.picture.toMachine(x, y);
  }

  /** @param {{x: number, y: number}} place */
  showPlace({ x, y }) {
    if (this.isMeasuring && this.picture.measured) return;
    const [mx, my] = this.picture.toMachine(x, y);
    byId("readout").textContent = `x ${mx.toFixed(2)} mm, y ${my.toFixed(2)} mm`;
  }

  showMeasured() {
    if (!this.picture.measured) return;
    const [x0, y0, x1, y1] = this.picture.measured;
    byId("readout").textContent = `${Math.hypot(x1 - x0, y1 - y0).toFixed(2)} mm (x ${(x1 - x0).toFixed(2)}, y ${(y1 - y0).toFixed(2)})`;
  }

  /** @param {boolean} on */
  setMeasuring(on) {
    this.isMeasuring = on;
    byId("measure").setAttribute("aria-pressed", String(on));
    this.front.classList.toggle("measuring", on);
    this.picture.measured = null;
    byId("readout").textContent = on ? "Drag from one place to another." : "";
    this.draw();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const target = /** @type {HTMLElement} */ (event.target);
    if (event.ctrlKey || event.altKey || event.metaKey || ["SELECT", "INPUT", "TEXTAREA"].includes(target.tagName)) return;
    if (target === this.front && this.tool?.key(event.key, event.shiftKey)) {
      event.preventDefault();
      return this.draw();
    }
    const isControl = ["BUTTON", "SUMMARY"].includes(target.tagName);
    if (isControl && (event.key === " " || event.key === "Enter")) return;
    const onPicture = target === this.front;
    const inPanel = target.closest(".panel, .strips") !== null;
    /** @type {Record<string, () => void>} */
    const actions = {
      " ": () => this.toggle(),
      Home: () => this.seek(0),
      End: () => this.seek(this.end),
      "[": () => this.step(-1),
      "]": () => this.step(1),
      "<": () => this.changeRate(-1),
      ">": () => this.changeRate(1),
      "+": () => this.zoom(1.4),
      "=": () => this.zoom(1.4),
      "-": () => this.zoom(1 / 1.4),
      f: () => this.fit(),
      m: () => this.setMeasuring(!this.isMeasuring),
      Escape: () => (this.isMeasuring ? this.setMeasuring(false) : this.select(-1, 0)),
      Enter: () => this.select(strokeAt(this.rows, this.row), this.row),
      ArrowLeft: () => (onPicture ? this.pan(40, 0) : this.nudge(-1, event.shiftKey)),
      ArrowRight: () => (onPicture ? this.pan(-40, 0) : this.nudge(1, event.shiftKey)),
    };
    if (onPicture) {
      actions.ArrowUp = () => this.pan(0, 40);
      actions.ArrowDown = () => this.pan(0, -40);
    }
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || (inPanel && ["Home", "End"].includes(event.key))) return;
    event.preventDefault();
    action();
  }

  /** @param {number} dx @param {number} dy */
  pan(dx, dy) {
    this.picture.pan(dx, dy);
    this.draw();
  }

  /** A second, or a row, back or on. @param {number} direction @param {boolean} byRow */
  nudge(direction, byRow) {
    if (!byRow) return this.seek(this.t + direction);
    const row = rowAt(this.rows.t, this.t + 1e-9);
    this.seek(this.rows.t[Math.min(Math.max(row + direction, 0), this.rows.t.length - 1)]);
  }

  /** @param {number} direction */
  changeRate(direction) {
    const select = /** @type {HTMLSelectElement} */ (byId("rate"));
    const index = Math.min(Math.max(RATES.indexOf(this.rate) + direction, 0), RATES.length - 1);
    this.rate = RATES[index];
    select.value = String(this.rate);
    this.say(`${this.rate} times`);
  }

  /** For screen readers. @param {string} text */
  say(text) {
    byId("status").textContent = text;
  }

  toggle() {
    if (this.isPlaying) return this.pause();
    if (this.t >= this.end) this.t = 0;
    this.isPlaying = true;
    this.before = performance.now();
    this.showPlaying();
    this.draw();
  }

  pause() {
    this.isPlaying = false;
    this.showPlaying();
    this.remember();
    this.draw();
  }

  showPlaying() {
    const button = byId("play");
    button.setAttribute("aria-label", this.isPlaying ? "Pause" : "Play");
    button.title = this.isPlaying ? "Pause (Space)" : "Play (Space)";
    byId("play-shape").setAttribute("d", this.isPlaying ? SHAPES.pause : SHAPES.play);
  }

  /** Goes to a time. @param {number} t */
  seek(t) {
    this.t = Math.min(Math.max(t, 0), this.end);
    this.before = performance.now();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.remember(), 300);
    this.draw();
  }

  /** Goes to where the next or the previous stroke begins. @param {number} direction */
  step(direction) {
    const { first, t } = this.rows;
    if (first.length === 0) return;
    const stroke = strokeAt(this.rows, rowAt(this.rows.t, this.t + 1e-9));
    const isInside = stroke >= 0 && this.t > t[first[stroke]] + 1e-6;
    const next = Math.min(Math.max(stroke + (direction < 0 && isInside ? 0 : direction), 0), first.length - 1);
    this.seek(t[first[next]]);
    this.select(next, first[next]);
    this.say(`stroke ${next + 1} of ${first.length}`);
  }

  /** The time in the address, so that a link leads here. */
  remember() {
    const hash = `#t=${Number(this.t.toFixed(3))}`;
    if (location.hash !== hash) history.replaceState(null, "", hash);
  }

  fromHash() {
    const found = /[#&]t=([0-9.]+)/.exec(location.hash);
    if (found && Number.isFinite(Number(found[1]))) this.seek(Number(found[1]));
  }

  /** The place of the pen at a hovered time. @param {number | null} t */
  hover(t) {
    if (t === null) {
      this.picture.hovered = null;
    } else {
      const row = rowAt(this.rows.t, t);
      this.picture.hovered = [this.rows.x[row], this.rows.y[row]];
    }
    this.draw();
  }

  /** @param {number} px @param {number} py */
  pick(px, py) {
    const found = this.picture.strokeNear(px, py);
    this.select(found?.stroke ?? -1, found?.row ?? 0);
    if (found) this.openTab("tab-stroke");
  }

  /** @param {number} stroke -1 for none @param {number} row */
  select(stroke, row) {
    this.selected = stroke;
    this.selectedRow = row;
    this.picture.selected = stroke;
    strokePanel(byId("panel-stroke"), this, stroke, row);
    this.draw();
  }

  /** Selects the ink of a byte of the drawing. @param {number} byte */
  selectByte(byte) {
    const piece = this.source.pieceOf(byte);
    if (piece < 0) return;
    const row = this.source.rows[piece];
    const stroke = strokeAt(this.rows, row);
    this.select(stroke, row);
    this.picture.reveal(stroke);
    this.say(`stroke ${stroke + 1} of ${this.rows.first.length}`);
  }

  /** Goes to a diagnostic's place. @param {any} found */
  goTo(found) {
    this.selectByte(found.start);
    if (found.at_mm) {
      this.picture.hovered = found.at_mm;
      this.picture.center(found.at_mm[0], found.at_mm[1]);
    }
    this.openTab("tab-stroke");
    byId("tab-stroke").focus();
    this.draw();
  }

  /** Colours ink by a quantity. @param {string} by */
  setColor(by) {
    this.colorBy = by;
    const count = this.rows.t.length;
    const legend = byId("legend");
    legend.hidden = by === "pen";
    if (by === "pen" || !this.motion) {
      this.picture.shade({ levels: null, colors: [] });
    } else if (by === "limit") {
      const levels = new Uint8Array(count);
      for (let row = 0; row < count; row++) if (this.rows.pen[row] !== 0) levels[row] = this.binds(row);
      const names = ["no limit above 95 %", ...(this.limits ?? []).map((limit) => limit.name)];
      const used = new Set(levels.filter((_, row) => this.rows.pen[row] !== 0));
      const items = names.flatMap((name, index) => (used.has(index) ? [element("li", {}, swatch(KINDS[index % KINDS.length]), name)] : []));
      legend.replaceChildren(element("p", { class: "name" }, "What limits the pen"), element("ul", {}, ...items));
      this.picture.shade({ levels, colors: names.map((_, index) => KINDS[index % KINDS.length]) });
    } else {
      this.shadeBy(by, count, legend);
    }
    this.draw();
  }

  /** @param {string} by @param {number} count @param {HTMLElement} legend */
  shadeBy(by, count, legend) {
    const { rows } = this;
    const unit = this.meta.deviation_unit_mm;
    /** @type {Record<string, {name: string, value: (row: number) => number, text: (value: number) => string}>} */
    const kinds = {
      speed: { name: "Pen speed", value: (row) => this.motion?.pen[row] ?? 0, text: (value) => `${short(value)} mm/s` },
      deviation: { name: "Distance from the drawing", value: (row) => (this.deviation?.[row] ?? 0) * unit, text: (value) => `${value.toFixed(3)} mm` },
      order: { name: "Order", value: (row) => rows.t[row], text: time },
    };
    const { name, value, text } = kinds[by];
    let most = 0;
    for (let row = 0; row < count; row++) if (rows.pen[row] !== 0) most = Math.max(most, value(row));
    const levels = new Uint8Array(count);
    const factor = most > 0 ? (LEVELS - 1e-6) / most : 0;
    for (let row = 0; row < count; row++) levels[row] = Math.min(value(row) * factor, LEVELS - 1);
    const ends = element("div", { class: "ends" }, element("span", {}, text(0)), element("span", {}, text(most)));
    legend.replaceChildren(element("p", { class: "name" }, name), ramp(Array.from({ length: 48 }, (_, k) => viridis(k / 47))), ends);
    this.picture.shade({ levels, colors: SCALE });
  }

  /** Asks for a frame. */
  draw() {
    if (this.requested) return;
    this.requested = true;
    if (!this.isDrawing) this.showDrawing(true);
    requestAnimationFrame((now) => this.frame(now));
  }

  /** @param {number} now */
  frame(now) {
    this.requested = false;
    if (this.isPlaying) {
      const passed = Math.min(Math.max((now - (this.before ?? now)) / 1000, 0), 0.25);
      this.before = now;
      this.t = Math.min(this.t + passed * this.rate, this.end);
      if (this.t >= this.end) this.pause();
    }
    this.row = rowAt(this.rows.t, this.t);
    const left = this.picture.frame({
      row: this.row,
      motors: motorsAt(this.rows, this.t),
      predictedRow: this.predicted ? rowAt(this.predicted.t, this.t) : 0,
      predictedMotors: this.predicted ? motorsAt(this.predicted, this.t) : null,
      isPlaying: this.isPlaying,
      tool: this.tool,
    });
    this.scrubber.set(this.t);
    this.strips?.setHead(this.t, this.isPlaying);
    const stroke = strokeAt(this.rows, this.row);
    const strokes = this.rows.first.length;
    byId("clock").textContent = `${time(this.t)} of ${time(this.end)} \u00b7 stroke ${whole(stroke + 1)} of ${whole(strokes)}`;
    if (!this.isPlaying) this.scrubber.describe(`stroke ${stroke + 1} of ${strokes}, pen ${this.rows.pen[this.row] === 0 ? "up" : "down"}`);
    if (!left && !this.isShown) {
      this.isShown = true;
      performance.mark("shown");
    }
    if (this.isPlaying || left) this.draw();
    else if (!this.requested) this.showDrawing(false);
  }

  /** Whether frames are still to come, for tests and tools that take pictures. @param {boolean} is */
  showDrawing(is) {
    this.isDrawing = is;
    this.stage.toggleAttribute("data-drawing", is);
  }
}
