// The cost that the page without a program shows before it submits is what `rayfold cost` prints, without a browser: `node --test`, with
// RAYFOLD (the program).

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { before, test } from "node:test";

import { load } from "./modules.mjs";

let cost;
before(async () => {
  cost = await load("static/stack/cost.ts");
});

function program(...args) {
  const run = spawnSync(process.env.RAYFOLD, ["cost", "--format", "json", "--quiet", ...args]);
  assert.equal(run.status, 0, String(run.stderr));
  return JSON.parse(run.stdout);
}

/** Compares the page's estimate of the program's workload with the program's. */
function compare({ workload, sections, as_of, region }) {
  const { frames, width, height, frame_kb: frameKb, outputs, files, files_mb: filesMb } = workload;
  // Without the time that an invocation waits, which the page adds.
  const drawingMs = workload.ms - cost.renderMs({ frames, drawingMs: 0 });
  const own = cost.estimate({ frames, width, height, drawingMs, frameKb, outputs, files, filesMb });
  assert.equal(cost.priced, `${region} on ${as_of}, in USD`);
  const words = (sections) => sections.map(({ title, lines }) => [title, ...lines.map(({ item, unit }) => [item, unit])]);
  assert.deepEqual(words(own), words(sections));
  const numbers = (sections) => sections.flatMap(({ usd, lines }) => [usd, ...lines.flatMap(({ amount, usd }) => [amount, usd])]);
  const theirs = numbers(sections);
  for (const [at, number] of numbers(own).entries()) {
    assert.ok(Math.abs(number - theirs[at]) <= 1e-9 * theirs[at], `${frames} frames, number ${at}: ${number} is not ${theirs[at]}`);
  }
}

test("the page estimates what the program does, for any number of frames", () => {
  for (const [frames, ms, size] of [[1, 250, "64x48"], [49, 300, "512x512"], [50, 1000, "512x512"], [1000, 400.5, "1920x1080"], [2001, 5000, "3840x2160"]]) {
    compare(program("--frames", String(frames), "--ms", String(ms), "--size", size));
  }
});

test("the page estimates what the program does for a project with files and several outputs", (t) => {
  const folder = mkdtempSync(join(tmpdir(), "rayfold-cost-"));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  const files = {
    "1.txt": 'Screen 48 32\nFrames 3\nLook 0 1 6  0 1 0  40\nIlight 1 1 1  1 -1 -1\nMesh "tent.obj"  .1 .1 .1  .5 .6 .7  0 0 0\nTrace\n',
    "tent.obj": "v -1 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n",
    "animation.json": '{"outputs": ["webp", "gif", "apng", "y4m"]}',
  };
  for (const [name, text] of Object.entries(files)) writeFileSync(join(folder, name), text);
  const report = program(folder);
  assert.deepEqual([report.workload.frames, report.workload.files, report.workload.outputs.length], [3, 1, 4]);
  compare(report);
});
