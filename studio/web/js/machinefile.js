// The machine: a preset or a file, its numbers as fields, its text with the compiler's messages.

import { byId, element } from "../viewer/js/dom.js";

/**
 * A number in a machine file that a field changes.
 * @typedef {object} Quantity
 * @property {string} table  its heading, such as `geometry` or `motor arm1`
 * @property {string} key
 * @property {number} value
 * @property {string} unit
 * @property {number} start  where the number begins in the text
 * @property {number} end  where it ends
 */

/** Sliders reach from a quarter of the value to four times it. */
const SPAN = 4;
/** Tables that are shown open. */
const OPEN = /^(geometry|pen|sheet)$/;

/** The numbers of a machine file with their places. @param {string} toml @returns {Quantity[]} */
export function quantities(toml) {
  /** @type {Quantity[]} */
  const found = [];
  let table = "";
  let at = 0;
  for (const line of toml.split("\n")) {
    const heading = /^\s*\[+\s*([A-Za-z0-9_.]+)\s*\]+/.exec(line);
    const value = /^(\s*([A-Za-z0-9_]+)\s*=\s*"?)(-?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(\s*[A-Za-z/%0-9]*)"?\s*(?:#.*)?$/.exec(line);
    const name = /^\s*name\s*=\s*"([^"]*)"/.exec(line);
    if (heading) table = heading[1];
    else if (name && table === "motor") table = `motor ${name[1]}`;
    else if (value && table !== "") {
      const [, before, key, number, unit] = value;
      found.push({ table, key, value: Number(number), unit: unit.trim(), start: at + before.length, end: at + before.length + number.length });
    }
    at += line.length + 1;
  }
  return found;
}

export class MachineEditor {
  /** @param {import("./studio.js").Studio} studio */
  constructor(studio) {
    this.studio = studio;
    this.text = /** @type {HTMLTextAreaElement} */ (byId("toml"));
    this.gutter = byId("gutter");
    this.preset = /** @type {HTMLSelectElement} */ (byId("preset"));
    this.bad = 0;
    /** Which fields are shown. */
    this.shape = "";
    /** @type {{number: HTMLInputElement, slider: HTMLInputElement}[]} */
    this.fields = [];
    this.preset.replaceChildren(...studio.catalogue.presets.map((/** @type {any} */ preset) => element("option", { value: preset.name }, preset.name)));
    this.preset.addEventListener("change", () => {
      this.machine.name = this.preset.value;
      this.machine.toml = "";
      this.show();
      studio.changed(false);
    });
    this.text.addEventListener("input", () => {
      this.machine.toml = this.text.value;
      this.showFields();
      this.showLines();
      studio.changed(true);
    });
    this.text.addEventListener("change", () => studio.changed(false));
    this.text.addEventListener("scroll", () => (this.gutter.scrollTop = this.text.scrollTop));
    byId("machine-reset").addEventListener("click", () => {
      if (!this.known) return;
      this.machine.toml = "";
      this.show();
      studio.changed(false);
    });
    const file = /** @type {HTMLInputElement} */ (byId("machine-file"));
    byId("machine-open").addEventListener("click", () => file.click());
    file.addEventListener("change", async () => {
      const [chosen] = file.files ?? [];
      file.value = "";
      if (chosen) this.open(chosen.name.replace(/\.toml$/, ""), await chosen.text());
    });
  }

  get machine() {
    return this.studio.state.machine;
  }

  /** The preset of the machine's name. */
  get known() {
    return this.studio.catalogue.presets.find((/** @type {any} */ preset) => preset.name === this.machine.name);
  }

  /** The text of the machine file. */
  get toml() {
    return this.machine.toml || this.known?.toml || "";
  }

  /** Opens a machine file. @param {string} name @param {string} toml */
  open(name, toml) {
    this.machine.name = name;
    this.machine.toml = toml;
    this.show();
    this.studio.openTab("tab-machine");
    this.studio.changed(false);
  }

  /** Shows the machine in the page. */
  show() {
    const { name } = this.machine;
    if (!this.known && ![...this.preset.options].some((option) => option.value === name)) {
      this.preset.append(element("option", { value: name }, `${name} (file)`));
    }
    this.preset.value = name;
    this.text.value = this.toml;
    this.bad = 0;
    this.showFields();
    this.showLines();
  }

  /** A field and a slider for each number. */
  showFields() {
    const isOwn = this.known && this.machine.toml !== "" && this.machine.toml !== this.known.toml;
    byId("machine-about").textContent = `${this.known?.about ?? "a machine file of your own"}${isOwn ? " (changed)" : ""}`;
    /** @type {HTMLButtonElement} */ (byId("machine-reset")).disabled = !isOwn;
    const all = quantities(this.toml);
    const shape = all.map(({ table, key, unit }) => `${table}.${key} ${unit}`).join(",");
    const box = byId("machine-fields");
    if (shape === this.shape) return this.refreshFields(all);
    this.shape = shape;
    box.replaceChildren();
    /** @type {Map<string, HTMLElement>} */
    const tables = new Map();
    this.fields = all.map((quantity, index) => {
      let table = tables.get(quantity.table);
      if (!table) {
        table = element("details", { class: "table" }, element("summary", {}, quantity.table));
        /** @type {HTMLDetailsElement} */ (table).open = OPEN.test(quantity.table);
        tables.set(quantity.table, table);
        box.append(table);
      }
      const label = `${quantity.key.replaceAll("_", " ")}${quantity.unit ? `, ${quantity.unit}` : ""}`;
      const number = /** @type {HTMLInputElement} */ (element("input", { type: "number", step: "any", inputmode: "decimal" }));
      const slider = /** @type {HTMLInputElement} */ (element("input", { type: "range", "aria-label": `${quantity.table}: ${label}` }));
      for (const input of [number, slider]) {
        input.addEventListener("input", () => this.set(index, input.value, true));
        input.addEventListener("change", () => this.set(index, input.value, false));
      }
      table.append(element("div", { class: "quantity" }, element("label", { class: "value" }, label, number), slider));
      return { number, slider };
    });
    this.refreshFields(all);
  }

  /** @param {Quantity[]} all */
  refreshFields(all) {
    all.forEach(({ value }, index) => {
      const field = this.fields[index];
      if (!field) return;
      const { number, slider } = field;
      if (document.activeElement !== number) number.value = String(value);
      if (document.activeElement === slider) return;
      // The ends stay where they are while the value is between them.
      if (slider.dataset.for !== this.machine.name || value < Number(slider.min) || value > Number(slider.max)) {
        const size = Math.abs(value) || 10;
        slider.dataset.for = this.machine.name;
        slider.min = String(value > 0 ? size / SPAN : -size * SPAN);
        slider.max = String(size * SPAN);
        slider.step = String(10 ** Math.floor(Math.log10(size / 100)));
        slider.min = String(Math.ceil(Number(slider.min) / Number(slider.step)) * Number(slider.step));
      }
      slider.value = String(value);
    });
  }

  /** Writes a number into the text. @param {number} index @param {string} text @param {boolean} isDraft */
  set(index, text, isDraft) {
    const value = Number(text);
    if (text.trim() === "" || !Number.isFinite(value)) return;
    const quantity = quantities(this.toml)[index];
    const number = String(Number(value.toPrecision(9)));
    this.machine.toml = this.toml.slice(0, quantity.start) + number + this.toml.slice(quantity.end);
    const { scrollTop } = this.text;
    this.text.value = this.machine.toml;
    this.text.scrollTop = scrollTop;
    this.showFields();
    this.studio.changed(isDraft);
  }

  /** Line numbers; that of a problem is marked. */
  showLines() {
    const count = this.text.value.split("\n").length;
    this.gutter.replaceChildren(...Array.from({ length: count }, (_, k) => element("span", k + 1 === this.bad ? { class: "bad" } : {}, String(k + 1))));
    this.gutter.scrollTop = this.text.scrollTop;
  }

  /** @param {import("./studio.js").Problem[]} problems */
  showProblems(problems) {
    const line = problems[0]?.line ?? 0;
    if (line !== this.bad) {
      this.bad = line;
      this.showLines();
    }
    this.text.setAttribute("aria-invalid", String(problems.length > 0));
    byId("machine-problems").replaceChildren(...problems.map((problem) => {
      const where = problem.line ? `Line ${problem.line}: ` : "";
      const box = element("div", { class: "problem" }, element("b", {}, `${where}${problem.message}`));
      if (problem.help) box.append(element("div", {}, problem.help));
      return box;
    }));
  }

  /** Brings a line into view and the cursor there. @param {number | null} line */
  goTo(line) {
    this.studio.openTab("tab-machine");
    const lines = this.text.value.split("\n");
    const start = lines.slice(0, (line ?? 1) - 1).reduce((sum, text) => sum + text.length + 1, 0);
    this.text.focus();
    this.text.setSelectionRange(start, start + (lines[(line ?? 1) - 1]?.length ?? 0));
    const height = parseFloat(getComputedStyle(this.text).lineHeight);
    this.text.scrollTop = Math.max(((line ?? 1) - 5) * height, 0);
  }
}
