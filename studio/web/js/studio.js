// The studio: what the page's controls change, is planned and shown.

import { byId, element, tabs } from "../viewer/js/dom.js";
import { length, plural } from "../viewer/js/format.js";
import { Superseded } from "./compiler.js";
import { MachineEditor } from "./machinefile.js";
import { Outputs } from "./outputs.js";
import { Outline } from "./outline.js";
import { Placer } from "./place.js";
import { Sketch } from "./sketch.js";
import { forget, fromBase64, initial, remember, toBase64 } from "./state.js";

/** @typedef {import("./state.js").Options} Options */
/** @typedef {{about: string, message: string, help: string | null, line: number | null, option: string | null}} Problem */

/** Fields whose text is an option, and its unit. @type {[string, keyof Options, string][]} */
const FIELDS = [
  ["tolerance", "tolerance", "mm"], ["period", "period", "ms"], ["order", "order", ""], ["effort", "effort", ""],
  ["speed", "speed", ""], ["rounding", "rounding", ""], ["page", "page", ""], ["pens", "pens", ""], ["hatch", "hatch", "mm"],
];
/** Options of the drawing's reader: its outline changes with them. */
const READING = ["page", "pens", "hatch"];

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
    this.notice = element("div", { class: "notice", role: "alert" });
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
    this.listen();
  }

  /** The job as the compiler takes it. @param {boolean} isDraft */
  job(isDraft = false) {
    return { machine: this.state.machine, options: this.state.options, draft: isDraft };
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
    if (state.file) await this.open(state.file.name, fromBase64(state.file.base64), state.sketch);
    else await this.plan(false);
  }

  listen() {
    const file = /** @type {HTMLInputElement} */ (byId("file"));
    byId("open").addEventListener("click", () => file.click());
    file.addEventListener("change", async () => {
      const [chosen] = file.files ?? [];
      file.value = "";
      if (chosen) await this.openFile(chosen);
    });
    byId("example").addEventListener("click", async () => {
      const response = await fetch(new URL("../examples/house.hpgl", import.meta.url));
      await this.open("house.hpgl", new Uint8Array(await response.arrayBuffer()));
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
    this.listenToDrops();
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
      const [dropped] = event.dataTransfer?.files ?? [];
      if (!dropped) return;
      event.preventDefault();
      await this.openFile(dropped);
    });
  }

  /** A machine file or a drawing. @param {File} file */
  async openFile(file) {
    const bytes = new Uint8Array(await file.arrayBuffer());
    if (file.name.endsWith(".toml")) this.editor.open(file.name.slice(0, -5), new TextDecoder().decode(bytes));
    else await this.open(file.name, bytes);
  }

  /**
   * Opens a drawing and plans it.
   * @param {string} name @param {Uint8Array} bytes @param {import("./state.js").Stroke[] | null} sketch  if it is one
   */
  async open(name, bytes, sketch = null) {
    this.sketch.end();
    this.placer.end();
    this.state.sketch = sketch;
    if (name !== this.state.file?.name) this.state.options.page = "";
    this.state.file = { name, base64: toBase64(bytes) };
    this.compiler.open(name, bytes);
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
    this.placer.planned(json, isDraft);
    if (!isDraft) {
      this.outputs.show();
      document.title = `${json.meta.title} - plotplan studio`;
      document.documentElement.dataset.planned = String(Number(document.documentElement.dataset.planned ?? 0) + 1);
    }
  }

  /** The picture is that of the last plan, not of what the page asks for now. */
  showStale() {
    const verdict = byId("verdict");
    verdict.hidden = false;
    verdict.textContent = "Not planned";
    verdict.classList.remove("good");
    verdict.classList.add("bad");
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
    byId("page-field").hidden = pages < 2;
    const select = /** @type {HTMLSelectElement} */ (byId("page"));
    select.replaceChildren(...Array.from({ length: pages }, (_, k) => element("option", { value: k === 0 ? "" : String(k + 1) }, `${k + 1} of ${pages}`)));
    select.value = this.state.options.page;
  }

  /** Shows the options in their fields. */
  showFields() {
    for (const [id, option, unit] of FIELDS) {
      const field = /** @type {HTMLInputElement | HTMLSelectElement} */ (byId(id));
      field.value = String(this.state.options[option]).replace(new RegExp(`${unit}$`), "");
    }
    /** @type {HTMLInputElement} */ (byId("outline-fills")).checked = this.state.options.outline_fills;
    /** @type {HTMLInputElement} */ (byId("smooth")).value = this.state.smooth;
  }

  /** Each problem at its place: the machine's at its line, the others over the picture. @param {Problem[]} problems */
  showProblems(problems = []) {
    this.editor.showProblems(problems.filter((problem) => problem.about === "machine"));
    const wrong = new Set(problems.map((problem) => problem.option));
    for (const [id, option] of FIELDS) byId(id).setAttribute("aria-invalid", String(wrong.has(option)));
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
