// One browser for all tests: pages that record what must not happen, pictures compared with
// references.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { chromium } from "playwright-core";

/** The folder of pages that `cargo xtask web-test` wrote. */
export const PAGES = process.env.PLOTPLAN_PAGES ?? "";
/** The program, and the studio's files. */
export const PROGRAM = process.env.PLOTPLAN_PROGRAM ?? "plotplan";
const STUDIO = process.env.PLOTPLAN_STUDIO_FILES ?? "";
/** References are written instead of compared. */
const WRITES = process.env.PLOTPLAN_WRITE_SCREENSHOTS === "1";
const REFERENCES = path.join(import.meta.dirname, "screenshots");
/** Where pictures that differ are put. */
const FOUND = path.join(PAGES, "screenshots");
/** A pixel differs if a channel does by more than this, of 255. */
const PIXEL = 48;
/** At most this share of pixels may differ: fonts and antialiasing are not the same everywhere. */
const SHARE = 0.01;

let browser;

export async function open() {
  browser ??= await chromium.launch({
    executablePath: process.env.PLOTPLAN_CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--enable-precise-memory-info"],
  });
  return browser;
}

export async function close() {
  await browser?.close();
  browser = undefined;
}

/**
 * Opens a page from the disk, runs `check`, and requires that nothing was written to the console, nothing
 * failed, and nothing but the file itself was asked for.
 */
export async function onPage(name, options, check) {
  const { hash = "", width = 1280, height = 800, scheme = "light", touch = false } = options;
  const context = await (await open()).newContext({
    viewport: { width, height },
    colorScheme: scheme,
    hasTouch: touch,
    reducedMotion: "reduce",
  });
  const page = await context.newPage();
  const events = [];
  page.on("console", (message) => events.push(`console: ${message.text()}`));
  page.on("pageerror", (error) => events.push(`error: ${error.message}`));
  const requests = [];
  page.on("request", (request) => requests.push(request.url()));
  try {
    await page.goto(`file://${path.join(PAGES, name)}${hash}`);
    await page.waitForSelector("html[data-ready]", { timeout: 30_000 });
    await settled(page);
    const result = await check(page);
    assert.deepEqual(events, []);
    assert.equal(requests.length, 1, requests.join(" "));
    return result;
  } finally {
    await context.close();
  }
}

/** The studio's address, while the program serves it. */
let address = "";

/** Has the program serve the studio; returns what ends it. */
export async function serve() {
  const server = spawn(PROGRAM, ["studio", "--no-open", "--port", "0", "--files", STUDIO], { stdio: ["ignore", "ignore", "pipe"] });
  address = await new Promise((done, failed) => {
    let text = "";
    server.stderr.on("data", (data) => {
      text += data;
      const found = /http:\/\/127\.0\.0\.1:\d+\//.exec(text);
      if (found) done(found[0]);
    });
    server.on("exit", () => failed(new Error(text)));
  });
  return () => server.kill();
}

/**
 * Opens the studio anew, runs `check`, and requires that nothing was written to the console, nothing failed,
 * and nothing was asked for but the studio's own files.
 */
export async function onStudio(options, check) {
  const { width = 1280, height = 800, scheme = "light", touch = false, mayFail = false } = options;
  const context = await (await open()).newContext({
    viewport: { width, height },
    colorScheme: scheme,
    hasTouch: touch,
    reducedMotion: "reduce",
    acceptDownloads: true,
  });
  const page = await context.newPage();
  const events = [];
  page.on("console", (message) => events.push(`console: ${message.text()}`));
  page.on("pageerror", (error) => events.push(`error: ${error.message}`));
  const outside = [];
  context.on("request", (request) => {
    const url = request.url();
    if (!url.startsWith(address) && !url.startsWith("blob:") && !url.startsWith("data:")) outside.push(url);
  });
  try {
    await page.goto(address);
    await page.waitForSelector("html[data-studio]", { timeout: 30_000 });
    await settled(page);
    const result = await check(page);
    if (!mayFail) assert.deepEqual(events, []);
    assert.deepEqual(outside, []);
    return result;
  } finally {
    await context.close();
  }
}

/** Waits until the page has drawn all that it had to: the studio's compiler and the viewer are idle. */
export async function settled(page) {
  // What was clicked reaches the compiler and the picture within these frames.
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => setTimeout(() => requestAnimationFrame(() => setTimeout(done, 40)), 40))));
  await page.waitForFunction(() => {
    const compiler = window.plotplanStudio?.compiler;
    const isIdle = !compiler || (!compiler.working && compiler.waiting.length === 0);
    return isIdle && document.documentElement.dataset.ready && !document.querySelector("#stage[data-drawing]");
  });
  // Diagrams take one more.
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
}

/** Compares a picture of the page, at half its size, with its reference. */
export async function compare(page, name) {
  const shot = (await page.screenshot()).toString("base64");
  const file = path.join(REFERENCES, `${name}.png`);
  const blank = await (await open()).newPage();
  try {
    const half = await blank.evaluate(halved, shot);
    const bytes = Buffer.from(half, "base64");
    if (WRITES) {
      fs.mkdirSync(REFERENCES, { recursive: true });
      fs.writeFileSync(file, bytes);
      return;
    }
    assert.ok(fs.existsSync(file), `no reference ${name}: look at the picture, then write it (docs/viewer.md)`);
    const share = await blank.evaluate(different, [half, fs.readFileSync(file).toString("base64"), PIXEL]);
    if (share > SHARE) {
      fs.mkdirSync(FOUND, { recursive: true });
      fs.writeFileSync(path.join(FOUND, `${name}.png`), bytes);
    }
    assert.ok(share <= SHARE, `${name}: ${(100 * share).toFixed(2)} % of the pixels differ; see ${FOUND}`);
  } finally {
    await blank.close();
  }
}

/* Both run in the browser. */

async function halved(base64) {
  const image = new Image();
  image.src = `data:image/png;base64,${base64}`;
  await image.decode();
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [image.width >> 1, image.height >> 1];
  const context = canvas.getContext("2d");
  context.imageSmoothingQuality = "high";
  context.drawImage(image, 0, 0, canvas.width, canvas.height);
  return canvas.toDataURL("image/png").split(",")[1];
}

async function different([one, other, most]) {
  const pixels = async (base64) => {
    const image = new Image();
    image.src = `data:image/png;base64,${base64}`;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    return context.getImageData(0, 0, image.width, image.height);
  };
  const [a, b] = [await pixels(one), await pixels(other)];
  if (a.width !== b.width || a.height !== b.height) return 1;
  let count = 0;
  for (let k = 0; k < a.data.length; k += 4) {
    const largest = Math.max(...[0, 1, 2].map((c) => Math.abs(a.data[k + c] - b.data[k + c])));
    if (largest > most) count++;
  }
  return count / (a.width * a.height);
}
