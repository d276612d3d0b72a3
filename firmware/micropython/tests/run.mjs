// Runs the tests under MicroPython: node run.mjs PLAN.ticks
import { readFileSync, readdirSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { loadMicroPython } from "@micropython/micropython-webassembly-pyscript/micropython.mjs";

const tests = dirname(fileURLToPath(import.meta.url));
const micropython = await loadMicroPython({ heapsize: 16 << 20, linebuffer: true });
const { FS } = micropython;
FS.mkdir("/board");
FS.mkdir("/board/plotplan");
const copy = (from, to) => {
    for (const name of readdirSync(from).filter((name) => name.endsWith(".py"))) {
        FS.writeFile(`${to}/${name}`, readFileSync(join(from, name)));
    }
};
copy(join(tests, "..", "plotplan"), "/board/plotplan");
copy(tests, "/board");
FS.writeFile("/board/plan.ticks", readFileSync(process.argv[2]));
FS.chdir("/board");
// The folder comes before the built-in modules: pyb.py and time.py are the simulated board.
micropython.runPython(`
import sys
sys.path.insert(0, "/board")
import tests
failed = tests.main()
`);
process.exit(micropython.globals.get("failed") === 0 ? 0 : 1);
