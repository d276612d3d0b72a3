// The sender's worker: the conversation with the machine. A worker of its own, because its timers keep their
// time in a page that is hidden, and because plans do not keep it waiting.

import { Module } from "./module.js";

/** The state is posted at most this often, ms. */
const EVERY_MS = 100;

/** @type {Module} */
let module;
let begun = 0;
/** @type {ReturnType<typeof setTimeout> | undefined} */
let timer;
/** Whether everything written before has left. */
let isClear = true;
let hasEnded = true;
let posted = 0;
let phase = "";

/** One step of the conversation. @param {string} event @param {Uint8Array | null} received */
function step(event = "time", received = null) {
  if (hasEnded) return;
  clearTimeout(timer);
  const now = performance.now();
  const { json, bytes } = module.call({ method: "wire", now_us: Math.round(1000 * (now - begun)), event, is_clear: isClear }, received);
  if (json.problems) throw new Error(json.problems[0].message);
  if (bytes.length > 0) {
    isClear = false;
    postMessage({ write: bytes }, { transfer: [bytes.buffer] });
  }
  hasEnded = json.wake_us === null;
  if (hasEnded || json.state.phase !== phase || now - posted >= EVERY_MS) {
    ({ phase } = json.state);
    posted = now;
    postMessage({ state: json.state, hasEnded });
  }
  if (hasEnded) return;
  // With bytes under way the next step comes when they have left.
  const wait = isClear ? json.wake_us / 1000 - (performance.now() - begun) : EVERY_MS;
  timer = setTimeout(step, Math.min(Math.max(wait, 0), EVERY_MS));
}

self.addEventListener("message", async ({ data }) => {
  try {
    if (data.module) {
      module = await Module.of(data.module);
      const { json } = module.call({ method: "send", job: data.job }, data.file);
      if (json.problems) return postMessage({ problems: json.problems });
      return postMessage({ isReady: true });
    }
    if (data.begin) {
      [begun, hasEnded] = [performance.now(), false];
      step();
    } else if (data.received) step("time", data.received);
    else if (data.hasWritten) {
      isClear = true;
      step();
    } else if (data.event) {
      if (data.event === "reconnected") isClear = true;
      step(data.event);
    }
  } catch (error) {
    hasEnded = true;
    postMessage({ problems: [{ about: "plan", message: `The sender stopped: ${module?.text(error) ?? error}` }] });
  }
});
