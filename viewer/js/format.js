// Numbers with their units, as text.

/** A time: `12.34 s`, `3 min 02.5 s`, `1 h 02 min 05 s`. @param {number} seconds */
export function time(seconds) {
  if (seconds < 60) return `${seconds.toFixed(2)} s`;
  const tenths = Math.round(seconds * 10);
  const minutes = Math.floor(tenths / 600);
  const rest = (tenths % 600) / 10;
  if (minutes < 60) return `${minutes} min ${rest.toFixed(1).padStart(4, "0")} s`;
  const hours = Math.floor(minutes / 60);
  return `${hours} h ${String(minutes % 60).padStart(2, "0")} min ${String(Math.floor(rest)).padStart(2, "0")} s`;
}

/** A length in mm, or in m from 1 m on. @param {number} mm */
export function length(mm) {
  return mm >= 1000 ? `${(mm / 1000).toFixed(2)} m` : `${mm.toFixed(mm < 10 ? 2 : 1)} mm`;
}

/** A share in percent. @param {number} share */
export function percent(share) {
  const percents = 100 * share;
  return `${percents.toFixed(percents < 9.95 && percents !== 0 ? 1 : 0)} %`;
}

/** A number with about three digits, thousands apart. @param {number} value */
export function short(value) {
  const size = Math.abs(value);
  const digits = size >= 100 || size === 0 ? 0 : size >= 10 ? 1 : size >= 1 ? 2 : 3;
  return grouped(value.toFixed(digits));
}

/** A whole number, thousands apart. @param {number} value */
export function whole(value) {
  return grouped(value.toFixed(0));
}

/** @param {string} text */
function grouped(text) {
  const [integer, fraction] = text.split(".");
  const groups = integer.replace(/\B(?=(\d{3})+$)/g, "\u202f").replace("-", "\u2212");
  return fraction === undefined ? groups : `${groups}.${fraction}`;
}

/** A count with its noun: `1 stroke`, `3 strokes`. @param {number} count @param {string} noun */
export function plural(count, noun) {
  return `${whole(count)} ${noun}${count === 1 ? "" : "s"}`;
}
