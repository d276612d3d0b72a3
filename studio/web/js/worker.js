// The worker: holds the compiler's WebAssembly module and answers requests one by one.

import { request, split } from "./protocol.js";

/** The steps of the work, by their numbers in `studio/wasm`. */
const STEPS = ["Placing", "Ordering", "Planning", "Verifying"];
/** Progress is posted at most this often, ms. */
const EVERY_MS = 80;

/**
 * @typedef {object} Exports
 * @property {WebAssembly.Memory} memory
 * @property {(length: number) => number} reserve
 * @property {() => number} call
 * @property {() => number} answer
 */

/** @type {Exports} */
let compiler;
let panic = "";
let posted = 0;
/** The number of the request in work. */
let current = 0;

const imports = {
  page: {
    progress(/** @type {number} */ step, /** @type {number} */ done, /** @type {number} */ all) {
      const now = performance.now();
      if (now - posted < EVERY_MS) return;
      posted = now;
      postMessage({ id: current, step: STEPS[step], share: all > 0 ? done / all : 0 });
    },
    panicked(/** @type {number} */ text, /** @type {number} */ length) {
      panic = new TextDecoder().decode(new Uint8Array(compiler.memory.buffer, text, length));
    },
  },
};

/**
 * Calls the compiler. @param {object} message @param {Uint8Array | null} bytes
 * @returns {{json: any, bytes: Uint8Array}}
 */
function call(message, bytes = null) {
  const packed = request(message, bytes);
  const place = compiler.reserve(packed.length);
  new Uint8Array(compiler.memory.buffer, place, packed.length).set(packed);
  const length = compiler.call();
  return split(new Uint8Array(compiler.memory.buffer, compiler.answer(), length).slice());
}

self.addEventListener("message", async ({ data }) => {
  current = data.id;
  try {
    if (data.module) {
      const instance = await WebAssembly.instantiate(/** @type {WebAssembly.Module} */ (data.module), imports);
      compiler = /** @type {Exports} */ (/** @type {unknown} */ (instance.exports));
      return postMessage({ id: data.id, json: {}, bytes: null });
    }
    if (data.file) call({ method: "open", name: data.file.name }, data.file.bytes);
    const { json, bytes } = call(data.message);
    postMessage({ id: data.id, json, bytes }, { transfer: bytes.length > 0 ? [bytes.buffer] : [] });
  } catch (error) {
    const text = panic || (error instanceof Error ? error.message : String(error));
    postMessage({ id: data.id, failure: text });
  }
});
