// What the page remembers: the drawing, the sketch, the machine, the options.

const KEY = "plotplan-studio-1";
/** A larger drawing is not remembered: browsers keep about 5 MB. */
const MOST_BYTES = 3 << 20;

/**
 * The options of the command line as text, empty where not given (`studio/src/job.rs`).
 * @typedef {object} Options
 * @property {string} tolerance @property {string} period @property {string} order @property {string} effort
 * @property {string} speed @property {string} rounding
 * @property {boolean} fit @property {string} align @property {string} place @property {string} scale
 * @property {string} rotate @property {string} mirror @property {string} margin
 * @property {string} page @property {string} pens @property {string} hatch @property {boolean} outline_fills
 */
/**
 * A stroke of the sketch: x and y in turn, mm from the sheet's lower-left corner.
 * @typedef {{pen: number, points: number[]}} Stroke
 * @typedef {object} State
 * @property {{name: string, base64: string} | null} file
 * @property {Stroke[] | null} sketch  if the drawing is a sketch
 * @property {string} smooth  mm
 * @property {{name: string, toml: string}} machine
 * @property {Options} options
 * @property {string} format
 * @property {string} tab
 */

/** @returns {State} */
export function initial() {
  return {
    file: null,
    sketch: null,
    smooth: "0.3",
    machine: { name: "coaxial", toml: "" },
    options: {
      tolerance: "", period: "", order: "", effort: "", speed: "", rounding: "",
      fit: true, align: "", place: "", scale: "", rotate: "", mirror: "", margin: "",
      page: "", pens: "", hatch: "", outline_fills: false,
    },
    format: "ticks",
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
    for (const key of /** @type {const} */ (["smooth", "format", "tab"])) {
      if (typeof stored[key] === "string") fresh[key] = stored[key];
    }
    if (typeof stored.file?.base64 === "string") fresh.file = stored.file;
    if (Array.isArray(stored.sketch) && fresh.file) fresh.sketch = stored.sketch;
  } catch {
    // A page without storage starts anew every time.
  }
  return fresh;
}

/** @param {State} state @returns {boolean} whether all of it is remembered */
export function remember(state) {
  const isSmall = (state.file?.base64.length ?? 0) <= MOST_BYTES;
  try {
    localStorage.setItem(KEY, JSON.stringify({ ...state, file: isSmall ? state.file : null }));
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
