// The worker: holds the compiler's WebAssembly module and answers requests one by one.

import { Module } from "./module.js";

/** The steps of the work, by their numbers in `studio/wasm`. */
const STEPS = ["Placing", "Ordering", "Planning", "Verifying"];
/** Progress is posted at most this often, ms. */
const EVERY_MS = 80;

/** @type {Module} */
let compiler;
let posted = 0;
/** The number of the request in work. */
let current = 0;

function progress(/** @type {number} */ step, /** @type {number} */ done, /** @type {number} */ all) {
  const now = performance.now();
  if (now - posted < EVERY_MS) return;
  posted = now;
  postMessage({ id: current, step: STEPS[step], share: all > 0 ? done / all : 0 });
}

self.addEventListener("message", async ({ data }) => {
  current = data.id;
  try {
    if (data.module) {
      compiler = await Module.of(data.module, progress);
      return postMessage({ id: data.id, json: {}, bytes: null });
    }
    data.file?.files.forEach((/** @type {{name: string, bytes: Uint8Array}} */ { name, bytes }, /** @type {number} */ k) => {
      compiler.call({ method: "open", name, adds: k > 0 }, bytes);
    });
    const { json, bytes } = compiler.call(data.message);
    postMessage({ id: data.id, json, bytes }, { transfer: bytes.length > 0 ? [bytes.buffer] : [] });
  } catch (error) {
    postMessage({ id: data.id, failure: compiler?.text(error) ?? String(error) });
  }
});
