// Starts the viewer with the plan that stands in the page.

import { inflate } from "./columns.js";
import { byId, element } from "./dom.js";
import { Viewer } from "./viewer.js";

async function start() {
  const meta = JSON.parse(byId("plan-meta").textContent ?? "");
  const bytes = await inflate(byId("plan-columns").textContent ?? "");
  return new Viewer(meta, bytes);
}

start().catch((error) => {
  document.body.prepend(element("p", { class: "failure", role: "alert" }, `The plan cannot be shown: ${error.message}`));
  throw error;
});
