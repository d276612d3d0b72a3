// Outputs: files that the program would write too, and its command line.

import { byId, element } from "../viewer/js/dom.js";
import { fromBase64 } from "./state.js";

/** @param {Uint8Array} bytes @param {string} name */
function save(bytes, name) {
  const url = URL.createObjectURL(new Blob([/** @type {Uint8Array<ArrayBuffer>} */ (bytes)], { type: "application/octet-stream" }));
  const link = /** @type {HTMLAnchorElement} */ (element("a", { href: url, download: name }));
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** A word as a shell takes it. @param {string} word */
export function quoted(word) {
  return /^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

export class Outputs {
  /** @param {import("./studio.js").Studio} studio */
  constructor(studio) {
    this.studio = studio;
    const { formats } = studio.catalogue;
    this.format = /** @type {HTMLSelectElement} */ (byId("format"));
    this.format.replaceChildren(...formats.map((/** @type {any} */ format) => element("option", { value: format.name }, format.name)));
    this.format.value = studio.state.format;
    this.format.addEventListener("change", () => {
      studio.state.format = this.format.value;
      studio.remember();
      this.show();
    });
    byId("download").addEventListener("click", () => this.write("format", this.format.value));
    byId("save-svg").addEventListener("click", () => this.write("picture", "svg"));
    byId("save-png").addEventListener("click", () => this.write("picture", "png"));
    byId("save-html").addEventListener("click", () => this.write("page", "html"));
    byId("save-machine").addEventListener("click", () => {
      const { name } = studio.state.machine;
      save(new TextEncoder().encode(studio.editor.toml), `${name}.toml`);
      this.say(`${name}.toml`);
    });
    byId("save-drawing").addEventListener("click", () => {
      const { file } = studio.state;
      if (!file) return;
      save(fromBase64(file.base64), file.name);
      this.say(file.name);
    });
    byId("copy").addEventListener("click", async () => {
      try {
        await navigator.clipboard.writeText(byId("command").textContent ?? "");
        byId("saved").textContent = "Copied.";
      } catch {
        // Browsers allow it on 127.0.0.1 and over HTTPS.
        byId("saved").textContent = "This browser does not let the page copy: select the text.";
      }
    });
    this.show();
  }

  /** @param {string} name */
  say(name) {
    byId("saved").textContent = `${name} was saved.`;
  }

  /** Writes a file. @param {string} kind @param {string} name */
  async write(kind, name) {
    const answer = await this.studio.ask("output", { method: "output", job: this.studio.job(), kind, name });
    if (!answer) return;
    if (answer.json.problems) return this.studio.showProblems(answer.json.problems);
    save(answer.bytes, answer.json.name);
    this.say(answer.json.name);
    if (answer.json.losses.length > 0) byId("saved").textContent += ` Not in this format: ${answer.json.losses.join("; ")}.`;
  }

  /** Shows what the format is, and the command lines. */
  async show() {
    const { studio } = this;
    const found = studio.catalogue.formats.find((/** @type {any} */ format) => format.name === this.format.value);
    byId("format-about").textContent = found?.about ?? "";
    for (const id of ["download", "save-svg", "save-png", "save-html", "save-drawing", "copy"]) {
      /** @type {HTMLButtonElement} */ (byId(id)).disabled = !studio.hasDrawing;
    }
    if (!studio.hasDrawing) {
      byId("command").textContent = "Open a drawing first.";
      return;
    }
    const outputs = [["format", this.format.value], ["page", "html"]];
    const answer = await studio.ask("commands", { method: "commands", job: studio.job(), outputs });
    if (!answer?.json.commands) return;
    // Lines break between words only.
    const parts = answer.json.commands.flatMap((/** @type {any} */ command) => [
      ...command.words.flatMap((/** @type {string} */ word, /** @type {number} */ k) => [k > 0 ? " " : "", element("span", {}, quoted(word))]),
      "\n",
    ]);
    byId("command").replaceChildren(...parts.slice(0, -1));
  }
}
