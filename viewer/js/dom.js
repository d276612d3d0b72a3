// Small helpers for the document.

/** The element of an id. @param {string} id @returns {HTMLElement} */
export function byId(id) {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no element ${id}`);
  return element;
}

/**
 * A new element.
 * @param {string} tag @param {Record<string, string>} attributes @param {(Node | string)[]} children
 * @returns {HTMLElement}
 */
export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/**
 * Makes a list of tabs work: clicks, and arrow keys. Returns the function that opens a tab by its id.
 * @param {HTMLElement} list @param {(id: string) => void} opened
 */
export function tabs(list, opened) {
  const all = [...list.querySelectorAll('[role="tab"]')].map((tab) => /** @type {HTMLElement} */ (tab));
  const open = (/** @type {string} */ id) => {
    for (const tab of all) {
      const isOpen = tab.id === id;
      tab.setAttribute("aria-selected", String(isOpen));
      tab.setAttribute("tabindex", isOpen ? "0" : "-1");
      byId(tab.getAttribute("aria-controls") ?? "").hidden = !isOpen;
    }
    opened(id);
  };
  all.forEach((tab, k) => {
    tab.addEventListener("click", () => open(tab.id));
    tab.addEventListener("keydown", (event) => {
      const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
      if (step === 0) return;
      event.preventDefault();
      event.stopPropagation();
      const next = all[(k + step + all.length) % all.length];
      open(next.id);
      next.focus();
    });
  });
  return open;
}

const SVG = "http://www.w3.org/2000/svg";

/** A filled bar from 0 to `share` of its width. @param {number} share @param {string} color */
export function bar(share, color) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 100 7");
  svg.setAttribute("preserveAspectRatio", "none");
  svg.setAttribute("aria-hidden", "true");
  for (const [width, fill, opacity] of [[100, "currentColor", "0.12"], [100 * share, color, "1"]]) {
    const rect = document.createElementNS(SVG, "rect");
    rect.setAttribute("width", String(width));
    rect.setAttribute("height", "7");
    rect.setAttribute("fill", String(fill));
    rect.setAttribute("opacity", String(opacity));
    svg.append(rect);
  }
  return svg;
}

/** A line in a colour, for legends. @param {string} color */
export function swatch(color) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 22 10");
  svg.setAttribute("width", "22");
  svg.setAttribute("height", "10");
  svg.setAttribute("aria-hidden", "true");
  const rect = document.createElementNS(SVG, "rect");
  rect.setAttribute("y", "3");
  rect.setAttribute("width", "22");
  rect.setAttribute("height", "4");
  rect.setAttribute("rx", "2");
  rect.setAttribute("fill", color);
  svg.append(rect);
  return svg;
}

/** A ramp of colours from left to right. @param {string[]} colors */
export function ramp(colors) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("class", "ramp");
  svg.setAttribute("viewBox", `0 0 ${colors.length} 1`);
  svg.setAttribute("preserveAspectRatio", "none");
  svg.setAttribute("aria-hidden", "true");
  colors.forEach((color, k) => {
    const rect = document.createElementNS(SVG, "rect");
    rect.setAttribute("x", String(k));
    rect.setAttribute("width", "1.05");
    rect.setAttribute("height", "1");
    rect.setAttribute("fill", color);
    svg.append(rect);
  });
  return svg;
}
