// What is true of the plan and of a stroke, in words.

import { bar, element, swatch } from "./dom.js";
import { length, percent, plural, time, whole } from "./format.js";
import { inkLength } from "./plan.js";

/** @param {string} name @param {string} value */
function row(name, value) {
  return element("tr", {}, element("th", { scope: "row" }, name), element("td", {}, value));
}

/** @param {(Node | string)[]} rows */
function table(...rows) {
  return element("table", {}, element("tbody", {}, ...rows));
}

/** A name and a value with a bar. @param {string} name @param {string} value @param {number} share @param {string} color */
function measured(name, value, share, color) {
  return element("div", { class: "bar" }, element("span", {}, name), element("span", {}, value), bar(share, color));
}

/** Millimetres of a distance. @param {any} distances */
function distance(distances) {
  return `${distances.more ? "more than " : ""}${distances.max_mm.toFixed(3)} mm`;
}

/**
 * The panel of the plan.
 * @param {HTMLElement} panel @param {any} meta @param {import("./plan.js").Track} rows
 */
export function planPanel(panel, meta, rows) {
  if (rows.t.length < 2) {
    panel.replaceChildren(element("p", {}, "There is no plan yet."));
    return;
  }
  panel.replaceChildren(
    ...certificate(meta),
    ...prediction(meta),
    ...times(meta, rows),
    ...limitedBy(meta),
    ...ink(meta, rows),
    element("p", { class: "soft" }, `Made by ${meta.program}. This page needs no network.`),
  );
}

/** @param {any} meta */
function certificate(meta) {
  const found = meta.certificate;
  if (!found) return [];
  const parts = [element("h2", {}, "Certificate")];
  const sentences = [];
  const { before_rounding: before, after_rounding: after } = found;
  if (!found.holds) {
    parts.push(element("p", { class: "error" }, "The certificate does not hold:"));
    parts.push(element("ul", {}, ...found.failures.map((/** @type {string} */ failure) => element("li", {}, failure))));
  } else if (after) {
    sentences.push("The plan was replayed through the machine’s kinematics and compared with the drawing. It holds.");
  } else {
    sentences.push("The motion was replayed and keeps the machine’s limits. There was no drawing to compare its ink with.");
  }
  if (before) {
    sentences.push(`The pen’s path stays within ${found.tolerance_mm} mm of the drawing: at most ${distance(before.ink_to_drawing)} from ink to drawing and ${distance(before.drawing_to_ink)} from drawing to ink.`);
  }
  if (after) {
    sentences.push(`Motors take whole ticks. With that rounding ink lies at most ${distance(after.ink_to_drawing)} off, 99 % of it within ${after.ink_to_drawing.p99_mm.toFixed(3)} mm; half a tick is up to ${found.tick_floor.worst_mm.toFixed(3)} mm here.`);
  }
  parts.push(element("p", {}, sentences.join(" ")));
  const head = element("tr", {}, ...["Highest share of the limit", "speed", "acceleration", "jerk"].slice(0, found.motors.some((/** @type {any} */ m) => m.jerk) ? 4 : 3).map((name) => element("th", { scope: "col" }, name)));
  const body = found.motors.map((/** @type {any} */ motor) => element("tr", {},
    element("th", { scope: "row" }, `motor ${motor.name}`),
    element("td", {}, percent(motor.speed_share)),
    element("td", {}, percent(motor.acceleration_share)),
    ...(motor.jerk ? [element("td", {}, percent(motor.jerk.share))] : [])));
  parts.push(element("table", {}, element("thead", {}, head), element("tbody", {}, ...body)));
  return parts;
}

/** @param {any} meta */
function prediction(meta) {
  const found = meta.prediction;
  if (!found) return [];
  return [
    element("h2", {}, "Predicted ink"),
    ...found.sentences.map((/** @type {string} */ sentence) => element("p", {}, sentence)),
    element("p", { class: "soft" }, "Wide and light: the plan. In the pens’ colours: the ink that motors and feedback loop are predicted to draw. Dashed: the planned pose."),
  ];
}

/** @param {any} meta @param {import("./plan.js").Track} rows */
function times(meta, rows) {
  const total = meta.duration_us * 1e-6;
  let [drawing, travel, lifting] = [0, 0, 0];
  if (meta.summary) {
    ({ drawing_s: drawing, travel_s: travel, lifting_s: lifting } = meta.summary);
  } else {
    for (let k = 0; k + 1 < rows.t.length; k++) {
      const span = rows.t[k + 1] - rows.t[k];
      const rests = rows.q[0][k] === rows.q[0][k + 1] && rows.q[1][k] === rows.q[1][k + 1] && span > 1.5e-6 * meta.period_us;
      if (rests) lifting += span;
      else if (rows.pen[k] !== 0) drawing += span;
      else travel += span;
    }
  }
  const part = (/** @type {string} */ name, /** @type {number} */ seconds, /** @type {string} */ color) =>
    measured(name, `${time(seconds)}, ${percent(seconds / total)}`, seconds / total, color);
  return [
    element("h2", {}, "Time"),
    element("p", {}, `${time(total)} in all.`),
    part("drawing", drawing, "var(--motor-a)"),
    part("travel", travel, "var(--motor-b)"),
    part("lifting and lowering the pen", lifting, "var(--pen-line)"),
  ];
}

/** @param {any} meta */
function limitedBy(meta) {
  const by = Object.entries(meta.summary?.limited_by_s ?? {}).sort((a, b) => b[1] - a[1]);
  const total = by.reduce((sum, [, seconds]) => sum + seconds, 0);
  const shown = by.filter(([, seconds]) => seconds >= 0.01 * total);
  return [
    element("h2", {}, "What limits drawing"),
    ...shown.map(([what, seconds]) => measured(what, percent(seconds / total), seconds / total, "var(--accent)")),
  ];
}

/** @param {any} meta @param {import("./plan.js").Track} rows */
function ink(meta, rows) {
  const { summary, certificate: found } = meta;
  const facts = [row("pen downs", whole(rows.first.length))];
  if (summary && summary.strokes !== rows.first.length) facts.unshift(row("strokes of the drawing", whole(summary.strokes)));
  if (found) facts.push(row("ink", length(found.ink_mm)), row("travel", length(found.travel_mm)));
  if (summary?.ordering) facts.push(row("travel in the file’s order", length(summary.ordering.travel_mm_before)));
  facts.push(row("rows", `${whole(rows.t.length)}, ${(meta.period_us / 1000).toFixed(meta.period_us % 1000 ? 2 : 0)} ms apart`));
  const pens = meta.pens.map((/** @type {any} */ pen) => element("li", {}, swatch(pen.color), ` pen ${pen.number}${pen.name ? `, ${pen.name}` : ""}`));
  return [element("h2", {}, "Ink"), table(...facts), element("ul", { class: "messages" }, ...pens)];
}

/**
 * The panel of a stroke.
 * @param {HTMLElement} panel @param {any} view the viewer
 * @param {number} stroke @param {number} at the row that was chosen
 */
export function strokePanel(panel, view, stroke, at) {
  const { meta, rows, source } = view;
  if (stroke < 0) {
    panel.replaceChildren(element("p", {}, "Click ink in the picture, or step with [ and ], to see a stroke and the place in the file it comes from."));
    return;
  }
  const [first, last] = [rows.first[stroke], rows.last[stroke]];
  const mm = inkLength(rows, stroke);
  const seconds = rows.t[last] - rows.t[first];
  const pen = meta.pens.find((/** @type {any} */ one) => one.number === rows.pen[first]);
  const parts = [
    element("h2", {}, `Stroke ${whole(stroke + 1)} of ${whole(rows.first.length)}`),
    table(
      row("pen", `${rows.pen[first]}${pen?.name ? `, ${pen.name}` : ""}`),
      row("length", length(mm)),
      row("pen down", `${time(rows.t[first])} to ${time(rows.t[last])}`),
      row("duration", time(seconds)),
      row("from", `${rows.x[first].toFixed(2)}, ${rows.y[first].toFixed(2)} mm`),
      row("to", `${rows.x[last].toFixed(2)}, ${rows.y[last].toFixed(2)} mm`),
    ),
  ];
  if (view.limits && mm > 0) {
    const by = new Map();
    for (let k = first; k < last; k++) {
      const index = view.binds(k);
      by.set(index, (by.get(index) ?? 0) + rows.t[k + 1] - rows.t[k]);
    }
    const shares = [...by].sort((a, b) => b[1] - a[1]).filter(([, s]) => s >= 0.02 * seconds);
    parts.push(element("h2", {}, "What limits it"));
    for (const [index, s] of shares) {
      const name = index === 0 ? "no limit above 95 %" : view.limits[index - 1].name;
      parts.push(measured(name, percent(s / seconds), s / seconds, "var(--accent)"));
    }
  }
  panel.replaceChildren(...parts, ...sourceOf(view, source, stroke, at));
}

/** @param {any} view @param {import("./source.js").Source} source @param {number} stroke @param {number} at */
function sourceOf(view, source, stroke, at) {
  const { rows } = view;
  const piece = source.pieceAt(Math.max(at, rows.first[stroke]));
  if (!source.isKnown || piece < 0) {
    return [element("p", { class: "soft" }, "The plan does not hold its drawing, so the place in the file is not known.")];
  }
  const first = source.pieceAt(rows.first[stroke]);
  const last = source.pieceAt(rows.last[stroke] - 1);
  const start = source.starts[piece];
  const end = start + source.lengths[piece];
  const place = source.locate(start);
  if (!place) return [];
  const bytes = `bytes ${whole(start - place.offset)} to ${whole(end - place.offset)}`;
  const found = source.lineColumn(start, place.offset);
  const line = found && found.lines > 1 ? `, line ${whole(found.line)}` : "";
  const parts = [element("h2", {}, "Source"), element("p", {}, `${place.file.name}: ${bytes}${line}`)];
  if (last > first) {
    const count = last - first + 1;
    parts.push(element("p", { class: "soft" }, `This pen down draws ${plural(count, "stroke")} of the file; this is number ${whole(piece - first + 1)}.`));
  }
  if (!source.text) {
    parts.push(element("p", { class: "soft" }, "The file is too large to be part of this page."));
    return parts;
  }
  const box = element("div", { class: "source", tabindex: "0", role: "group", "aria-label": "Text of the drawing; click to find its ink" });
  box.addEventListener("click", (event) => {
    const byte = source.byteOfClick(box, event);
    if (byte !== null) view.selectByte(byte);
  });
  parts.push(box);
  queueMicrotask(() => source.show(box, start, end));
  return parts;
}

/** The list of diagnostics. @param {HTMLElement} panel @param {any} view */
export function messagesPanel(panel, view) {
  const { diagnostics } = view.meta;
  if (diagnostics.length === 0) {
    panel.replaceChildren(element("p", {}, "The drawing was read without a message."));
    return;
  }
  const items = diagnostics.map((/** @type {any} */ found) => {
    const times = found.count > 1 ? ` (${whole(found.count)} times; the first place)` : "";
    const parts = [element("b", { class: found.severity }, `${found.severity} ${found.code}`), element("div", {}, `${found.message}${times}`)];
    if (found.help) parts.push(element("div", { class: "soft" }, found.help));
    if (found.place) parts.push(element("div", { class: "soft" }, found.place));
    if (found.start !== null && view.source.isKnown) {
      const button = element("button", { type: "button" }, "Show the place");
      button.addEventListener("click", () => view.goTo(found));
      parts.push(button);
    }
    return element("li", {}, ...parts);
  });
  panel.replaceChildren(element("ul", { class: "messages" }, ...items));
}
