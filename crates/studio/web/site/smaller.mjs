// Makes a WebAssembly module smaller: node smaller.mjs FROM TO. What only the tools of `wasm-bindgen` would need is left
// out, with its imports: no call of the studio reaches them.

import { readFileSync, writeFileSync } from "node:fs";

import binaryen from "binaryen";

const NAMES = ["memory", "call", "input", "output"];

const [from, to] = process.argv.slice(2);
const module = binaryen.readBinary(readFileSync(from));
module.setFeatures(binaryen.Features.All & ~binaryen.Features.GC & ~binaryen.Features.RelaxedSIMD);
const exports = Array.from({ length: module.getNumExports() }, (_, at) => binaryen.getExportInfo(module.getExportByIndex(at)).name);
for (const name of exports) if (!NAMES.includes(name)) module.removeExport(name);
binaryen.setOptimizeLevel(2);
binaryen.setShrinkLevel(1);
module.optimize();
writeFileSync(to, module.emitBinary());
