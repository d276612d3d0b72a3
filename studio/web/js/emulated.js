// An emulated machine behind the interface of a serial port, to rehearse without a machine.

import { Module } from "./module.js";

/** Waits of less than this are not worth a timer, ms. */
const TICK_MS = 4;

/** The part of Web Serial's `SerialPort` that the studio uses. */
export class EmulatedPort extends EventTarget {
  /** @param {WebAssembly.Module} module @param {object} job which machine (`EmulateJob`) @param {number} speedup */
  constructor(module, job, speedup = 1) {
    super();
    this.module = module;
    this.job = job;
    this.speedup = speedup;
    /** @type {Module | null} */
    this.machine = null;
    /** @type {ReadableStream<Uint8Array> | null} */
    this.readable = null;
    /** @type {WritableStream<Uint8Array> | null} */
    this.writable = null;
    /** Everything that the machine has received. @type {Uint8Array[]} */
    this.received = [];
    this.begun = performance.now();
    this.isUnplugged = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  /** Opens the port; the machine is switched on with the first opening. */
  async open() {
    if (!this.machine) {
      this.machine = await Module.of(this.module);
      const { json } = this.machine.call({ method: "emulate", job: this.job });
      if (json.problems) throw new Error(json.problems[0].message);
    }
    this.readable = new ReadableStream({ start: (controller) => void (this.out = controller) });
    this.writable = new WritableStream({ write: (bytes) => this.step(bytes.slice()) });
    this.isUnplugged = false;
  }

  /** Time passes, and the machine receives bytes. @param {Uint8Array | null} bytes */
  step(bytes = null) {
    clearTimeout(this.timer);
    if (!this.machine) return;
    if (this.isUnplugged) bytes = null;
    if (bytes) this.received.push(bytes);
    const now_us = Math.round((performance.now() - this.begun) * 1000 * this.speedup);
    const { json, bytes: answers } = this.machine.call({ method: "device", now_us, is_unplugged: this.isUnplugged }, bytes);
    if (answers.length > 0 && !this.isUnplugged) this.out?.enqueue(answers);
    this.ink = json.ink;
    if (json.wake_us === null) return;
    const wait = (json.wake_us - now_us) / 1000 / this.speedup;
    this.timer = setTimeout(() => this.step(), Math.max(wait, TICK_MS));
  }

  /** The lines of ink that it has drawn, as `plotplan emulate --ink` writes them. */
  drawn() {
    return new TextDecoder().decode(this.machine?.call({ method: "ink" }).bytes);
  }

  /** The plug is pulled; the machine itself goes on. */
  unplug() {
    this.isUnplugged = true;
    this.out?.error(new Error("the device has been lost"));
    [this.readable, this.writable] = [null, null];
    this.step();
    this.dispatchEvent(new Event("disconnect"));
  }

  async close() {
    if (!this.isUnplugged && this.readable) this.out?.close();
    [this.readable, this.writable, this.out] = [null, null, undefined];
  }
}
