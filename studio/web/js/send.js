// Sending the plan to a machine on a serial port (Web Serial), or to an emulated one. The conversation is the
// program's own (`studio/src/sending.rs`); the page owns the port, a worker the time.

import { byId, element } from "../viewer/js/dom.js";
import { time } from "../viewer/js/format.js";
import { EmulatedPort } from "./emulated.js";
import { quoted } from "./outputs.js";

/** Phases in which nothing is sent. */
const ENDED = ["done", "stopped", "failed"];
/** How much faster than real time the emulated machine is. @type {Record<string, number>} */
const SPEEDUPS = { emulated: 1, fast: 20 };

/**
 * The part of Web Serial's `SerialPort` that is used.
 * @typedef {object} SerialPort
 * @property {ReadableStream<Uint8Array> | null} readable
 * @property {WritableStream<Uint8Array> | null} writable
 * @property {(options: {baudRate: number, flowControl?: string, bufferSize?: number}) => Promise<void>} open
 * @property {() => Promise<void>} close
 */

/** The browser's serial ports; undefined where it has none. @returns {(EventTarget & {requestPort: () => Promise<SerialPort>}) | undefined} */
function serial() {
  return /** @type {any} */ (navigator).serial;
}

export class Sender {
  /** @param {import("./studio.js").Studio} studio */
  constructor(studio) {
    this.studio = studio;
    /** @type {SerialPort | null} */
    this.port = null;
    /** @type {Worker | null} */
    this.worker = null;
    /** @type {WritableStreamDefaultWriter<Uint8Array> | null} */
    this.writer = null;
    /** @type {ReadableStreamDefaultReader<Uint8Array> | null} */
    this.reader = null;
    this.phase = "";
    /** The emulated machine that is switched on, and which one it is. @type {EmulatedPort | null} */
    this.emulated = null;
    this.emulatedKey = "";
    this.isAway = false;
    /** @type {string[]} */
    this.losses = [];
    this.protocol = /** @type {HTMLSelectElement} */ (byId("protocol"));
    this.target = /** @type {HTMLSelectElement} */ (byId("send-to"));
    this.baud = /** @type {HTMLInputElement} */ (byId("baud"));
    this.flow = /** @type {HTMLSelectElement} */ (byId("flow"));
    this.from = /** @type {HTMLInputElement} */ (byId("from-row"));
    this.datum = /** @type {HTMLSelectElement} */ (byId("datum"));
    this.bar = /** @type {HTMLProgressElement} */ (byId("sent"));
    this.text = byId("send-state");
    this.protocol.replaceChildren(...studio.catalogue.protocols.map((/** @type {any} */ protocol) => element("option", { value: protocol.name }, protocol.name)));
    this.protocol.value = studio.state.protocol;
    if (!serial()) {
      byId("no-serial").hidden = false;
      this.target.value = "emulated";
      /** @type {HTMLOptionElement} */ (this.target.options[0]).disabled = true;
    }
    this.protocol.addEventListener("change", () => {
      studio.state.protocol = this.protocol.value;
      studio.remember();
      this.from.value = "";
      this.show();
    });
    for (const field of [this.target, this.from, this.datum, this.baud, this.flow]) field.addEventListener("change", () => this.show());
    byId("send").addEventListener("click", () => this.begin());
    byId("pause").addEventListener("click", () => this.tell(["paused", "pausing", "waiting", "pose"].includes(this.phase) ? "resume" : "pause"));
    byId("stop").addEventListener("click", () => this.tell("stop"));
    addEventListener("beforeunload", (event) => {
      if (this.isSending) event.preventDefault();
    });
    this.show();
  }

  get isSending() {
    return this.worker !== null;
  }

  get info() {
    return this.studio.catalogue.protocols.find((/** @type {any} */ protocol) => protocol.name === this.protocol.value);
  }

  /** Shows what can be done, and the command line that does the same. */
  async show() {
    const { studio, info } = this;
    byId("protocol-about").textContent = info?.about ?? "";
    const disable = (/** @type {string} */ id, /** @type {boolean} */ is) => (/** @type {HTMLButtonElement} */ (byId(id)).disabled = is);
    const isReal = this.target.value === "port";
    const canBegin = studio.hasDrawing && (isReal || info?.is_emulated);
    disable("send", this.isSending || !canBegin);
    disable("pause", !this.isSending);
    disable("stop", !this.isSending);
    for (const field of [this.protocol, this.target, this.baud, this.flow, this.from, this.datum]) field.disabled = this.isSending;
    byId("pause").textContent = { paused: "Continue", pausing: "Continue", waiting: "Continue", pose: "Continue" }[this.phase] ?? "Pause";
    this.baud.disabled ||= !isReal;
    this.flow.disabled ||= !isReal;
    if (!isReal && !info?.is_emulated) this.text.textContent = "There is no emulated machine for this protocol.";
    else if (!this.phase) this.text.textContent = studio.hasDrawing ? "" : "Open a drawing first.";
    if (!studio.hasDrawing) return byId("send-command").replaceChildren("Open a drawing first.");
    const answer = await studio.ask("send-command", { method: "commands", job: studio.job(), outputs: [["format", info?.format ?? "ticks"]] });
    if (!answer?.json.commands) return;
    const [{ name, words }] = answer.json.commands;
    const machine = words.find((/** @type {string} */ word) => word.startsWith("--machine="));
    const send = ["plotplan", "send", name, "--port=PORT", `--protocol=${this.protocol.value}`];
    if (this.baud.value !== "115200") send.push(`--baud=${this.baud.value}`);
    if (this.flow.value !== "none") send.push(`--flow=${this.flow.value}`);
    if (this.from.value) send.push(`--from=${this.from.value}`);
    if (machine?.endsWith(".toml")) send.push(machine);
    if (this.datum.value === "home") send.push("--home");
    if (this.datum.value === "assume") send.push("--assume-homed");
    const line = (/** @type {string[]} */ all) => all.flatMap((word, k) => [k > 0 ? " " : "", element("span", {}, quoted(word))]);
    byId("send-command").replaceChildren(...line(words), "\n", ...line(send));
  }

  /** @param {string} text */
  say(text) {
    this.text.textContent = text;
  }

  async begin() {
    const { studio, info } = this;
    if (this.isSending || !info) return;
    // The browser shows its list of ports only while a click is being handled.
    let port;
    try {
      port = await this.choose();
    } catch (error) {
      this.phase = "failed";
      this.say(/** @type {Error} */ (error).name === "NotFoundError" ? "No port was chosen." : `The port cannot be used: ${/** @type {Error} */ (error).message}`);
      return;
    }
    const file = await studio.ask("send", { method: "output", job: studio.job(), kind: "format", name: info.format });
    if (!file) return;
    if (file.json.problems) return this.say(file.json.problems[0].message);
    this.port = port;
    this.phase = "asking";
    this.say("Opening the port.");
    this.losses = file.json.losses;
    const worker = new Worker(new URL("./sender.js", import.meta.url), { type: "module" });
    this.worker = worker;
    this.show();
    worker.addEventListener("message", ({ data }) => this.heard(data));
    worker.addEventListener("error", (event) => this.end("failed", event.message || "The sender did not start."));
    const from = this.from.value === "" ? null : Number(this.from.value);
    const job = { protocol: this.protocol.value, machine: studio.state.machine, datum: this.datum.value, from };
    worker.postMessage({ module: studio.compiler.module, job, file: file.bytes });
  }

  /** The port that the operator chooses. @returns {Promise<SerialPort>} */
  async choose() {
    const { studio } = this;
    if (this.target.value === "port") return /** @type {any} */ (serial()).requestPort();
    const speedup = SPEEDUPS[this.target.value];
    // The machine stays switched on until another one is chosen.
    const job = { protocol: this.protocol.value, machine: studio.state.machine, homed: true };
    const key = JSON.stringify([job, speedup]);
    if (this.emulatedKey !== key || this.from.value === "") this.emulated = new EmulatedPort(studio.compiler.module, job, speedup);
    this.emulatedKey = key;
    return /** @type {any} */ (this.emulated);
  }

  /** Opens the port and reads it until it is lost. */
  async open() {
    const { port } = this;
    if (!port) return;
    await port.open({ baudRate: Number(this.baud.value) || 115200, flowControl: this.flow.value, bufferSize: 4096 });
    this.writer = port.writable?.getWriter() ?? null;
    this.read(port);
  }

  /** @param {SerialPort} port @returns {Promise<void>} */
  async read(port) {
    this.reader = port.readable?.getReader() ?? null;
    try {
      while (this.reader) {
        const { value, done } = await this.reader.read();
        if (done) break;
        this.worker?.postMessage({ received: value });
      }
    } catch {
      // A parity or framing error ends this stream only; without another one the port is gone.
      this.reader?.releaseLock();
      if (port.readable && this.worker) return this.read(port);
    }
    if (this.worker) this.lose();
  }

  /** The port is away: it is opened again as soon as it is back. */
  lose() {
    if (this.isAway || !this.worker) return;
    this.isAway = true;
    this.tell("lost");
    this.release();
    this.retry = setInterval(async () => {
      try {
        await this.port?.close().catch(() => {});
        await this.open();
        clearInterval(this.retry);
        this.isAway = false;
        this.tell("reconnected");
      } catch {
        // Not yet.
      }
    }, 300);
  }

  release() {
    try {
      this.writer?.releaseLock();
      this.reader?.releaseLock();
    } catch {
      // A read under way ends with the stream.
    }
    [this.writer, this.reader] = [null, null];
  }

  /** @param {string} event */
  tell(event) {
    this.worker?.postMessage({ event });
  }

  /** The worker's messages. @param {any} data */
  async heard(data) {
    if (data.problems) return this.end("failed", data.problems[0].message);
    if (data.isReady) {
      try {
        await this.open();
      } catch (error) {
        return this.end("failed", `The port cannot be opened: ${/** @type {Error} */ (error).message}`);
      }
      this.worker?.postMessage({ begin: true });
    } else if (data.write) {
      try {
        await this.writer?.write(data.write);
        this.worker?.postMessage({ hasWritten: true });
      } catch {
        this.lose();
      }
    } else if (data.state) this.showState(data.state, data.hasEnded);
  }

  /** @param {any} state @param {boolean} hasEnded */
  showState({ phase, text, progress, row }, hasEnded) {
    const isNew = phase !== this.phase;
    this.phase = phase;
    if (progress) {
      this.bar.value = progress.of_us > 0 ? progress.done_us / progress.of_us : progress.lines / Math.max(progress.of_lines, 1);
      const again = progress.retransmitted > 0 ? `, ${progress.retransmitted} sent again` : "";
      byId("send-progress").textContent = `${progress.lines} of ${progress.of_lines} lines${again}\n${time(progress.done_us / 1e6)} of ${time(progress.of_us / 1e6)}`;
      // The arm stands where the machine has acknowledged it to be.
      if (this.info?.format === "ticks" && this.from.value === "") this.studio.viewer.seek(progress.done_us / 1e6);
    }
    if (hasEnded) {
      if (phase === "done") this.bar.value = 1;
      if (row !== null) this.from.value = String(row);
      else if (phase === "done") this.from.value = "";
      return this.end(phase, row === null ? text : `${text} Send resumes there.`);
    }
    if (isNew || this.text.textContent !== text) this.say(text);
    if (isNew) this.show();
  }

  /** @param {string} phase @param {string} text */
  async end(phase, text) {
    const { port, reader, writer } = this;
    this.worker?.terminate();
    this.worker = null;
    clearInterval(this.retry);
    this.isAway = false;
    this.phase = phase;
    const losses = phase === "done" && this.losses.length > 0 ? ` Not sent: ${this.losses.join("; ")}.` : "";
    this.say(text + losses);
    this.show();
    document.documentElement.dataset.sent = `${Number((document.documentElement.dataset.sent ?? "0").split(" ")[0]) + 1} ${ENDED.includes(phase) ? phase : "failed"}`;
    await reader?.cancel().catch(() => {});
    await writer?.close().catch(() => {});
    this.release();
    await port?.close().catch(() => {});
    this.port = null;
  }
}
