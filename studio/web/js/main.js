// Starts the studio: compiler, viewer, and what was there at the last visit.

import { byId, element } from "../viewer/js/dom.js";
import { Viewer } from "../viewer/js/viewer.js";
import { Compiler } from "./compiler.js";
import { restored } from "./state.js";
import { Studio } from "./studio.js";

/** The name of each step is shown after this time, so that quick plans do not flicker, ms. */
const PATIENCE_MS = 250;

/** Shows what the compiler does. @param {HTMLElement} stage */
function progressOf(stage) {
  const label = element("span", {});
  const bar = /** @type {HTMLProgressElement} */ (element("progress", { max: "1", "aria-label": "Progress" }));
  const box = element("div", { class: "progress" }, label, bar);
  box.hidden = true;
  stage.append(box);
  let begun = 0;
  return (/** @type {string | null} */ step, /** @type {number} */ share) => {
    if (!step) {
      begun = 0;
      box.hidden = true;
      return;
    }
    begun ||= performance.now();
    if (performance.now() - begun < PATIENCE_MS) return;
    label.textContent = `${step} ${(100 * share).toFixed(0)} %`;
    bar.value = share;
    box.hidden = false;
  };
}

async function start() {
  const compiler = new Compiler(await Compiler.load(new URL("../studio.wasm", import.meta.url)), progressOf(byId("stage")));
  const state = restored();
  const catalogue = (await compiler.ask("catalogue", { method: "catalogue" })).json;
  const job = { machine: { name: catalogue.presets[0].name, toml: "" } };
  const { json, bytes } = await compiler.ask("machine", { method: "machine", job });
  const studio = new Studio(state, catalogue, compiler, new Viewer(json.meta, bytes));
  // For the console of the browser, and for tests.
  Object.assign(window, { plotplanStudio: studio });
  await studio.begin();
  document.documentElement.dataset.studio = "ready";
}

start().catch((error) => {
  document.body.prepend(element("p", { class: "failure", role: "alert" }, `The studio cannot start: ${error.message}`));
  throw error;
});
