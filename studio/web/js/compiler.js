// The compiler for the page: requests to a worker, of which a newer one ends an older one.
//
// A worker cannot be interrupted, so it is ended and a spare one takes its place. While something is
// dragged, drafts must appear: a draft that has just begun is finished first, and only the newest of
// those that came meanwhile follows.

/** A draft may work this long while newer ones wait, ms. */
const PATIENCE_MS = 400;

/** A spare worker that did not start is started again after this time, ms. */
const RETRY_MS = 5000;

/** Why a request has no answer: a newer one took its place. */
export class Superseded extends Error {}

/**
 * @typedef {object} Answer
 * @property {any} json
 * @property {Uint8Array} bytes
 * @typedef {object} Job
 * @property {{name: string, toml: string}} machine
 * @property {object} options
 * @property {boolean} draft
 * @typedef {object} Request
 * @property {number} id
 * @property {string} kind  requests of one kind supersede each other
 * @property {object} message
 * @property {boolean} isDraft
 * @property {number} begun  when its work began, ms
 * @property {(answer: Answer) => void} done
 * @property {(error: Error) => void} failed
 */

/** A worker and the drawing that it has open. */
class Hand {
  /** @param {WebAssembly.Module} module @param {(hand: Hand, data: any) => void} heard */
  constructor(module, heard) {
    this.worker = new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
    this.file = 0;
    this.isReady = false;
    this.worker.addEventListener("message", ({ data }) => heard(this, data));
    this.worker.addEventListener("error", (event) => heard(this, { id: -1, failure: event.message || "the worker did not start" }));
    this.worker.postMessage({ id: 0, module });
  }
}

export class Compiler {
  /** @param {WebAssembly.Module} module @param {(step: string | null, share: number) => void} progress */
  constructor(module, progress) {
    this.module = module;
    this.progress = progress;
    this.count = 0;
    /** @type {{id: number, files: {name: string, bytes: Uint8Array}[]} | null} */
    this.file = null;
    /** @type {Request | null} */
    this.working = null;
    /** @type {Request[]} */
    this.waiting = [];
    this.hand = this.newHand();
    this.spare = this.newHand();
  }

  /** The module of a URL. @param {URL} url */
  static async load(url) {
    const response = await fetch(url);
    if (!response.ok) throw new Error(`${url.pathname}: ${response.status}`);
    // Not all static hosts know the media type that streaming asks for.
    return WebAssembly.compile(await response.arrayBuffer());
  }

  newHand() {
    return new Hand(this.module, (hand, data) => this.heard(hand, data));
  }

  /** Opens a drawing's files for the requests that follow; several lie over each other. @param {{name: string, bytes: Uint8Array}[]} files */
  open(files) {
    this.file = { id: ++this.count, files };
  }

  /**
   * Asks the compiler.
   * @param {string} kind @param {object} message @param {boolean} isDraft @returns {Promise<Answer>}
   */
  ask(kind, message, isDraft = false) {
    return new Promise((done, failed) => {
      /** @type {Request} */
      const request = { id: ++this.count, kind, message, isDraft, begun: 0, done, failed };
      this.waiting = this.waiting.filter((other) => other.kind !== kind || (other.failed(new Superseded()), false));
      this.waiting.push(request);
      const { working } = this;
      if (working && working.kind === kind) {
        const patience = working.isDraft && isDraft ? PATIENCE_MS - (performance.now() - working.begun) : 0;
        if (patience <= 0) this.end();
        else setTimeout(() => this.endLate(working), patience);
      }
      this.next();
    });
  }

  /** Ends a draft for which newer requests have waited long enough. @param {Request} late */
  endLate(late) {
    if (this.working !== late || !this.waiting.some((other) => other.kind === late.kind)) return;
    this.end();
    this.next();
  }

  /** Ends the request in work; without a spare worker, as when the server is gone, it is finished first. */
  end() {
    if (!this.spare.isReady) return;
    this.working?.failed(new Superseded());
    this.replace();
  }

  /** Takes the spare worker. */
  replace() {
    this.hand.worker.terminate();
    this.hand = this.spare;
    this.spare = this.newHand();
    this.working = null;
    this.progress(null, 0);
  }

  next() {
    if (this.working) return;
    const request = this.waiting.shift();
    if (!request) return;
    this.working = request;
    request.begun = performance.now();
    const isKnown = !this.file || this.hand.file === this.file.id;
    const file = isKnown ? null : this.file;
    this.hand.file = this.file?.id ?? 0;
    this.hand.worker.postMessage({ id: request.id, message: request.message, file });
  }

  /** @param {Hand} hand @param {any} data */
  heard(hand, data) {
    const request = this.working;
    if (data.id === 0) hand.isReady = true;
    if (data.id === -1 && hand === this.spare && !hand.isReady) {
      // Tried again when it is needed next.
      hand.worker.terminate();
      setTimeout(() => this.spare === hand && (this.spare = this.newHand()), RETRY_MS);
      return;
    }
    if (hand !== this.hand || !request || (data.id !== request.id && data.id !== -1)) return;
    if (data.step) {
      if (!request.isDraft) this.progress(data.step, data.share);
      return;
    }
    if (data.failure) {
      // The module stopped in the middle of its work.
      this.replace();
      request.failed(new Error(`The compiler stopped: ${data.failure}`));
    } else {
      this.working = null;
      this.progress(null, 0);
      request.done({ json: data.json, bytes: data.bytes });
    }
    this.next();
  }
}
