// The compiler's WebAssembly module: a call takes a request and returns an answer (`studio/wasm`).

import { request, split } from "./protocol.js";

/**
 * @typedef {object} Exports
 * @property {WebAssembly.Memory} memory
 * @property {(length: number) => number} reserve
 * @property {() => number} call
 * @property {() => number} answer
 */

export class Module {
  /** @param {Exports} exports */
  constructor(exports) {
    this.exports = exports;
    /** The text of a panic: the module cannot be used afterwards. */
    this.panic = "";
  }

  /**
   * An instance. @param {WebAssembly.Module} module
   * @param {(step: number, done: number, all: number) => void} progress
   * @returns {Promise<Module>}
   */
  static async of(module, progress = () => {}) {
    /** @type {Module} */
    let instance;
    const imports = {
      page: {
        progress,
        panicked(/** @type {number} */ text, /** @type {number} */ length) {
          instance.panic = new TextDecoder().decode(new Uint8Array(instance.exports.memory.buffer, text, length));
        },
      },
    };
    const { exports } = await WebAssembly.instantiate(module, imports);
    instance = new Module(/** @type {Exports} */ (/** @type {unknown} */ (exports)));
    return instance;
  }

  /**
   * Asks the module. @param {object} message @param {Uint8Array | null} bytes
   * @returns {{json: any, bytes: Uint8Array<ArrayBuffer>}}
   */
  call(message, bytes = null) {
    const { exports } = this;
    const packed = request(message, bytes);
    const place = exports.reserve(packed.length);
    new Uint8Array(exports.memory.buffer, place, packed.length).set(packed);
    const length = exports.call();
    return split(new Uint8Array(exports.memory.buffer, exports.answer(), length).slice());
  }

  /** What an error of the module means. @param {unknown} error */
  text(error) {
    return this.panic || (error instanceof Error ? error.message : String(error));
  }
}
