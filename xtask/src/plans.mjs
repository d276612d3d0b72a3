// Plans by the studio's WebAssembly module: node plans.mjs STUDIO FOLDER "MACHINE ..." DRAWING ...
// Each drawing of the folder on each preset, at the largest size that fits, as tick lines in the folder:
// NUMBER-MACHINE.ticks. A refused plan has no file.
import { readFile, writeFile } from "node:fs/promises";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [studio, folder, machines, ...drawings] = process.argv.slice(2);
const { request, split } = await import(pathToFileURL(join(studio, "js/protocol.js")).href);

let panic = "";
const page = {
  progress() {},
  panicked(text, length) {
    panic = new TextDecoder().decode(new Uint8Array(memory().buffer, text, length));
  },
};
const module = await WebAssembly.compile(await readFile(join(studio, "studio.wasm")));
const { exports } = await WebAssembly.instantiate(module, { page });
const memory = () => exports.memory;

function call(message, bytes = null) {
  const packed = request(message, bytes);
  const place = exports.reserve(packed.length);
  new Uint8Array(memory().buffer, place, packed.length).set(packed);
  try {
    const length = exports.call();
    return split(new Uint8Array(memory().buffer, exports.answer(), length).slice());
  } catch (error) {
    throw new Error(panic || String(error));
  }
}

for (const [number, drawing] of drawings.entries()) {
  call({ method: "open", name: drawing }, new Uint8Array(await readFile(join(folder, drawing))));
  for (const machine of machines.split(" ")) {
    const job = { machine: { name: machine }, options: { fit: true } };
    const { json, bytes } = call({ method: "output", job, kind: "format", name: "ticks" });
    if (!json.problems) await writeFile(join(folder, `${number}-${machine}.ticks`), bytes);
  }
}
