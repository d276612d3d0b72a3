// What the page remembers: the drawing, the sketch, the machine, the options.

import { isArea } from "./area.js";

const KEY = "plotplan-studio-1";
/** A larger drawing is not remembered: browsers keep about 5 MB. */
const MOST_BYTES = 3 << 20;

/**
 * The options of the command line as text, empty where not given (`studio/src/job.rs`).
 * @typedef {object} Options
 * @property {string} tolerance @property {string} period @property {string} order @property {string} effort
 * @property {string} speed @property {string} law @property {string} segment_time @property {string} rounding
 * @property {boolean} fit @property {string} align @property {string} place @property {string} for @property {string} scale
 * @property {string} rotate @property {string} mirror @property {string} margin
 * @property {string} paper @property {string} only_pens @property {string} copies @property {string} gap
 * @property {string} page @property {string} pens @property {string} hatch @property {boolean} outline_fills
 */
/**
 * A stroke of the sketch: x and y in turn, mm from the sheet's lower-left corner.
 * @typedef {{pen: number, points: number[]}} Stroke
 * @typedef {object} State
 * @property {{name: string, base64: string} | null} file
 * @property {{name: string, base64: string}[]} others  files laid over the first
 * @property {Stroke[] | null} sketch  if the drawing is a sketch
 * @property {string} smooth  mm
 * @property {import("./area.js").Area | null} area  the pad of the sketch; the sheet itself if null
 * @property {{name: string, toml: string}} machine
 * @property {Options} options
 * @property {string} format
 * @property {string} protocol
 * @property {string} tab
 */

/** @returns {State} */
export function initial() {
  return {
    file: null,
    others: [],
    sketch: null,
    smooth: "0.3",
    area: null,
    machine: { name: "coaxial", toml: "" },
    options: {
      tolerance: "", period: "", order: "", effort: "", speed: "", law: "", segment_time: "", rounding: "",
      paper: "", only_pens: "", copies: "", gap: "",
      fit: true, align: "", place: "", for: "", scale: "", rotate: "", mirror: "", margin: "",
      page: "", pens: "", hatch: "", outline_fills: false,
    },
    format: "ticks",
    protocol: "ticks",
    tab: "tab-drawing",
  };
}

/** The state of the last visit. @returns {State} */
export function restored() {
  const fresh = initial();
  try {
    const stored = JSON.parse(localStorage.getItem(KEY) ?? "{}");
    const known = (/** @type {any} */ into, /** @type {any} */ from) => {
      for (const key of Object.keys(into)) if (from && typeof from[key] === typeof into[key]) into[key] = from[key];
    };
    known(fresh.options, stored.options);
    known(fresh.machine, stored.machine);
    for (const key of /** @type {const} */ (["smooth", "format", "protocol", "tab"])) {
      if (typeof stored[key] === "string") fresh[key] = stored[key];
    }
    if (typeof stored.file?.base64 === "string") fresh.file = stored.file;
    const isFile = (/** @type {any} */ other) => typeof other?.name === "string" && typeof other?.base64 === "string";
    if (fresh.file && Array.isArray(stored.others)) fresh.others = stored.others.filter(isFile);
    if (isArea(stored.area)) fresh.area = stored.area;
    if (Array.isArray(stored.sketch) && fresh.file) fresh.sketch = stored.sketch;
  } catch {
    // A page without storage starts anew every time.
  }
  return fresh;
}

/** @param {State} state @returns {boolean} whether all of it is remembered */
export function remember(state) {
  const size = [state.file, ...state.others].reduce((sum, file) => sum + (file?.base64.length ?? 0), 0);
  const isSmall = size <= MOST_BYTES;
  try {
    localStorage.setItem(KEY, JSON.stringify(isSmall ? state : { ...state, file: null, others: [] }));
    return isSmall;
  } catch {
    return false;
  }
}

export function forget() {
  try {
    localStorage.removeItem(KEY);
  } catch {
    // As above.
  }
}

/** @param {Uint8Array} bytes */
export function toBase64(bytes) {
  let text = "";
  for (let k = 0; k < bytes.length; k += 8192) text += String.fromCharCode(...bytes.subarray(k, k + 8192));
  return btoa(text);
}

/** @param {string} base64 */
export function fromBase64(base64) {
  return Uint8Array.from(atob(base64), (char) => char.charCodeAt(0));
}
