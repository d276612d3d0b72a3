// The studio: what the page's controls change, is planned and shown.

import { byId, element, tabs } from "../viewer/js/dom.js";
import { length, plural } from "../viewer/js/format.js";
import { Superseded } from "./compiler.js";
import { MachineEditor } from "./machinefile.js";
import { Outputs } from "./outputs.js";
import { Outline } from "./outline.js";
import { Placer } from "./place.js";
import { Sender } from "./send.js";
import { Sketch } from "./sketch.js";
import { forget, fromBase64, initial, remember, toBase64 } from "./state.js";

/** @typedef {import("./state.js").Options} Options */
/** @typedef {{about: string, message: string, help: string | null, line: number | null, option: string | null}} Problem */

/** Fields whose text is an option, and its unit. @type {[string, keyof Options, string][]} */
const FIELDS = [
  ["tolerance", "tolerance", "mm"], ["period", "period", "ms"], ["order", "order", ""], ["effort", "effort", ""],
  ["speed", "speed", ""], ["law", "law", ""], ["segment-time", "segment_time", "ms"], ["rounding", "rounding", ""],
  ["page", "page", ""], ["pens", "pens", ""], ["hatch", "hatch", "mm"], ["gap", "gap", "mm"], ["paper", "paper", ""],
];
/** Options of the drawing's reader: its outline changes with them. */
const READING = ["page", "pens", "hatch", "gap", "copies", "only_pens"];
/** Laws with a time for each segment. */
const FIXED = ["linear", "sine", "quadratic"];

export class Studio {
  /**
   * @param {import("./state.js").State} state @param {any} catalogue
   * @param {import("./compiler.js").Compiler} compiler @param {import("../viewer/js/viewer.js").Viewer} viewer
   */
  constructor(state, catalogue, compiler, viewer) {
    this.state = state;
    this.catalogue = catalogue;
    this.compiler = compiler;
    this.viewer = viewer;
    /** @type {Outline | null} */
    this.outline = null;
    /** Whether the files that are opened next lie over those that are open. */
    this.adds = false;
    this.notice = element("div", { class: "notice", role: "alert" });
    /** What the notice was made from, as JSON. */
    this.shownNotice = "";
    this.welcome = element("div", { class: "welcome" }, element("p", {}, "Drop an HPGL, SVG or points file here, open one, or sketch on the sheet."));
    viewer.stage.append(this.welcome, this.notice);
    this.openTab = tabs(byId("setup-tabs"), (id) => {
      this.state.tab = id;
      this.remember();
    });
    this.editor = new MachineEditor(this);
    this.placer = new Placer(this);
    this.sketch = new Sketch(this);
    this.outputs = new Outputs(this);
    this.sender = new Sender(this);
    this.listen();
  }

  /** The job as the compiler takes it. @param {boolean} isDraft */
  job(isDraft = false) {
    const { machine, options } = this.state;
    // A search takes hundreds of plans: drafts stay where the last one led.
    const { found } = this.placer;
    const isKept = isDraft && options.place === "best" && found;
    const kept = isKept ? { ...options, place: `${found.place_mm[0]}mm,${found.place_mm[1]}mm`, rotate: String(found.rotate_deg) } : options;
    return { machine, options: kept, draft: isDraft };
  }

  get hasDrawing() {
    return this.compiler.file !== null;
  }

  /** Shows the last visit's state. */
  async begin() {
    const { state } = this;
    this.showFields();
    this.editor.show();
    this.openTab(state.tab);
    const files = [state.file, ...state.others].flatMap((file) => (file ? [{ name: file.name, bytes: fromBase64(file.base64) }] : []));
    if (files.length > 0) await this.open(files, state.sketch);
    else await this.plan(false);
  }

  listen() {
    const file = /** @type {HTMLInputElement} */ (byId("file"));
    for (const [id, adds] of /** @type {[string, boolean][]} */ ([["open", false], ["add", true]])) {
      byId(id).addEventListener("click", () => {
        this.adds = adds;
        file.click();
      });
    }
    file.addEventListener("change", async () => {
      const chosen = [...(file.files ?? [])];
      file.value = "";
      await this.openFiles(chosen, this.adds);
    });
    byId("example").addEventListener("click", async () => {
      const response = await fetch(new URL("../examples/house.hpgl", import.meta.url));
      await this.open([{ name: "house.hpgl", bytes: new Uint8Array(await response.arrayBuffer()) }]);
    });
    byId("reset").addEventListener("click", () => {
      forget();
      Object.assign(this.state, initial());
      this.compiler.file = null;
      this.outline = null;
      this.sketch.end();
      this.placer.end();
      byId("facts").replaceChildren();
      this.begin();
    });
    for (const [id, option, unit] of FIELDS) {
      const field = /** @type {HTMLInputElement | HTMLSelectElement} */ (byId(id));
      const changed = (/** @type {boolean} */ isDraft) => {
        const text = field.value.trim();
        Object.assign(this.state.options, { [option]: text === "" ? "" : `${text}${unit}` });
        this.showDependent();
        this.changed(isDraft, READING.includes(option));
      };
      if (field.tagName === "INPUT") field.addEventListener("input", () => changed(true));
      field.addEventListener("change", () => changed(false));
    }
    const fills = /** @type {HTMLInputElement} */ (byId("outline-fills"));
    fills.addEventListener("change", () => {
      this.state.options.outline_fills = fills.checked;
      this.changed(false, true);
    });
    for (const id of ["columns", "rows"]) {
      byId(id).addEventListener("change", () => {
        const [columns, rows] = ["columns", "rows"].map((id) => Math.max(1, Math.round(Number(/** @type {HTMLInputElement} */ (byId(id)).value) || 1)));
        this.state.options.copies = columns * rows === 1 ? "" : `${columns}x${rows}`;
        this.showDependent();
        this.changed(false, true);
      });
    }
    this.listenToDrops();
  }

  /** Fields that belong to what is chosen in others. */
  showDependent() {
    const { options } = this.state;
    byId("segment-time-field").hidden = !FIXED.includes(options.law);
    byId("gap-field").hidden = options.copies === "";
  }

  listenToDrops() {
    const hasFiles = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes("Files") ?? false;
    document.addEventListener("dragover", (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      document.body.classList.add("dropping");
    });
    document.addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) document.body.classList.remove("dropping");
    });
    document.addEventListener("drop", async (event) => {
      document.body.classList.remove("dropping");
      const dropped = [...(event.dataTransfer?.files ?? [])];
      if (dropped.length === 0) return;
      event.preventDefault();
      await this.openFiles(dropped, false);
    });
  }

  /** Machine files and drawings; several drawings lie over each other. @param {File[]} files @param {boolean} adds */
  async openFiles(files, adds) {
    const opened = await Promise.all(files.map(async (file) => ({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) })));
    for (const { name, bytes } of opened) {
      if (name.endsWith(".toml")) this.editor.open(name.slice(0, -5), new TextDecoder().decode(bytes));
    }
    const drawings = opened.filter(({ name }) => !name.endsWith(".toml"));
    const before = adds && this.compiler.file ? this.compiler.file.files : [];
    if (drawings.length > 0) await this.open([...before, ...drawings]);
  }

  /**
   * Opens a drawing of one file or several, and plans it.
   * @param {{name: string, bytes: Uint8Array}[]} files @param {import("./state.js").Stroke[] | null} sketch  if it is one
   */
  async open(files, sketch = null) {
    this.sketch.end();
    this.placer.end();
    this.state.sketch = sketch;
    if (files[0].name !== this.state.file?.name) Object.assign(this.state.options, { page: "", only_pens: "" });
    const [file, ...others] = files.map(({ name, bytes }) => ({ name, base64: toBase64(bytes) }));
    Object.assign(this.state, { file, others });
    this.compiler.open(files);
    this.isFresh = true;
    await this.changed(false, true);
  }

  /**
   * Something changed: the drawing is planned again, as a draft while it is still being dragged.
   * @param {boolean} isDraft @param {boolean} isReadAgain
   */
  async changed(isDraft, isReadAgain = false) {
    if (!isDraft) this.remember();
    // The plan does not wait for the outline.
    const planned = this.plan(isDraft);
    if (isReadAgain) await this.readDrawing();
    await planned;
  }

  remember() {
    this.isRemembered = remember(this.state);
  }

  /** Asks the compiler; null where a newer request took its place. @param {string} kind @param {object} message @param {boolean} isDraft */
  async ask(kind, message, isDraft = false) {
    try {
      return await this.compiler.ask(kind, message, isDraft);
    } catch (error) {
      if (error instanceof Superseded) return null;
      this.showProblems([{ about: "plan", message: /** @type {Error} */ (error).message, help: null, line: null, option: null }]);
      return null;
    }
  }

  /** @param {boolean} isDraft */
  async plan(isDraft) {
    const method = this.hasDrawing ? "plan" : "machine";
    const answer = await this.ask("plan", { method, job: this.job(isDraft) }, isDraft);
    if (!answer) return;
    const { json, bytes } = answer;
    this.welcome.hidden = this.hasDrawing || this.sketch.isOn;
    this.showProblems(json.problems);
    if (!json.meta) return this.showStale();
    this.viewer.show(json.meta, bytes, isDraft);
    const canPlay = json.meta.duration_us > 0;
    if (this.isFresh && canPlay) {
      // The whole drawing; play starts it.
      this.viewer.seek(this.viewer.end);
      this.isFresh = false;
    }
    if (json.problems.length > 0) this.showStale();
    else if (isDraft) this.showVerdict("Draft");
    this.placer.planned(json, isDraft);
    if (!isDraft) {
      this.outputs.show();
      this.sender.show();
      document.title = `${json.meta.title} - plotplan studio`;
      document.documentElement.dataset.planned = String(Number(document.documentElement.dataset.planned ?? 0) + 1);
    }
  }

  /** The picture is that of the last plan, not of what the page asks for now. */
  showStale() {
    this.showVerdict("Not planned");
    byId("verdict").classList.add("bad");
  }

  /** @param {string} text */
  showVerdict(text) {
    const verdict = byId("verdict");
    verdict.hidden = false;
    verdict.textContent = text;
    verdict.classList.remove("good", "bad");
  }

  async readDrawing() {
    const answer = await this.ask("drawing", { method: "drawing", job: this.job() });
    if (!answer || !answer.json.columns) return;
    this.outline = new Outline(answer.json, answer.bytes);
    this.placer.showPlace();
    this.showFacts(answer.json);
  }

  /** What the file is. @param {any} found */
  showFacts(found) {
    const { report } = found;
    const pages = report.pages.length;
    const page = report.pages[found.page - 1];
    const size = found.bounds_mm ? [found.bounds_mm[2] - found.bounds_mm[0], found.bounds_mm[3] - found.bounds_mm[1]] : null;
    const row = (/** @type {string} */ name, /** @type {string} */ value) => element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, value));
    const rows = [row("format", report.format), row("strokes", `${page.strokes}`), row("ink", length(page.ink_mm))];
    if (size) rows.push(row("size", `${size[0].toFixed(1)} x ${size[1].toFixed(1)} mm`));
    const count = found.findings.length;
    if (count > 0) rows.push(row("messages", plural(count, "message")));
    const parts = [element("h2", {}, found.name), element("table", {}, element("tbody", {}, ...rows))];
    if (this.isRemembered === false) parts.push(element("p", { class: "soft" }, "This drawing is too large to be remembered: it is gone when the page is closed."));
    byId("facts").replaceChildren(...parts);
    byId("svg-fields").hidden = report.format !== "SVG" || this.sketch.isOn;
    byId("add").hidden = this.sketch.isOn;
    this.showPens(found.pens);
    byId("page-field").hidden = pages < 2;
    const select = /** @type {HTMLSelectElement} */ (byId("page"));
    select.replaceChildren(...Array.from({ length: pages }, (_, k) => element("option", { value: k === 0 ? "" : String(k + 1) }, `${k + 1} of ${pages}`)));
    select.value = this.state.options.page;
  }

  /** The pens of the files, each to be drawn or left out. @param {number[]} pens */
  showPens(pens) {
    const chosen = () => this.state.options.only_pens.split(",").filter((pen) => pen !== "").map(Number);
    byId("pens-field").hidden = pens.length < 2;
    byId("only-pens").replaceChildren(...pens.map((pen) => {
      const box = /** @type {HTMLInputElement} */ (element("input", { type: "checkbox" }));
      box.checked = chosen().length === 0 || chosen().includes(pen);
      box.addEventListener("change", () => {
        const before = chosen().length === 0 ? pens : chosen();
        const now = pens.filter((other) => (other === pen ? box.checked : before.includes(other)));
        if (now.length === 0) return void (box.checked = true);
        this.state.options.only_pens = now.length === pens.length ? "" : now.join(",");
        this.changed(false, true);
      });
      return element("label", { class: "check" }, box, ` ${pen}`);
    }));
  }

  /** Shows the options in their fields. */
  showFields() {
    for (const [id, option, unit] of FIELDS) {
      const field = /** @type {HTMLInputElement | HTMLSelectElement} */ (byId(id));
      field.value = String(this.state.options[option]).replace(new RegExp(`${unit}$`), "");
    }
    /** @type {HTMLInputElement} */ (byId("outline-fills")).checked = this.state.options.outline_fills;
    /** @type {HTMLInputElement} */ (byId("smooth")).value = this.state.smooth;
    const [columns = "", rows = ""] = this.state.options.copies.split("x");
    /** @type {HTMLInputElement} */ (byId("columns")).value = columns;
    /** @type {HTMLInputElement} */ (byId("rows")).value = rows;
    this.showDependent();
  }

  /** Each problem at its place: the machine's at its line, the others over the picture. @param {Problem[]} problems */
  showProblems(problems = []) {
    this.editor.showProblems(problems.filter((problem) => problem.about === "machine"));
    const wrong = new Set(problems.map((problem) => problem.option));
    for (const [id, option] of FIELDS) byId(id).setAttribute("aria-invalid", String(wrong.has(option.replaceAll("_", "-"))));
    // A press of a button in the notice takes the focus from a field, which plans again: the button
    // that is being pressed stays while the notice would say the same.
    const shown = JSON.stringify([problems, this.outline !== null]);
    if (shown === this.shownNotice) return;
    this.shownNotice = shown;
    const items = problems.map((problem) => {
      const where = problem.about === "machine" ? `Machine file${problem.line ? `, line ${problem.line}` : ""}: ` : "";
      const box = element("div", { class: "problem" }, element("b", {}, `${where}${problem.message}`));
      if (problem.help) box.append(element("div", {}, problem.help));
      if (problem.about === "plan" && this.outline) box.append(this.placer.remedies());
      if (problem.about === "machine") {
        const go = element("button", { type: "button" }, "Show the line");
        go.addEventListener("click", () => this.editor.goTo(problem.line));
        box.append(go);
      }
      return box;
    });
    this.notice.replaceChildren(...items);
  }
}
