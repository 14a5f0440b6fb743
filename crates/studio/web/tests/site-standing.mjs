// The state of a run as the page without a program computes it, without a browser: on the cases that the program's own test reads.

import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { before, test } from "node:test";

import { load } from "./modules.mjs";

const root = join(import.meta.dirname, "..");
let standing, receipts;
before(async () => {
  standing = await load("static/stack/standing.ts");
  receipts = await load("static/stack/receipts.ts");
});

/** The version of an object in the store of the program's test. */
const versionOf = (text) => createHash("sha256").update(text).digest("hex").slice(0, 32);

async function computed({ scripts, files, manifest, receipts: found = [] }) {
  const { faults, frameUpdate, isBehind, manifestOf, outputsOf, summary } = standing;
  const text = manifest === null || typeof manifest === "string" ? manifest : JSON.stringify(manifest);
  const known = manifestOf("film", text);
  const there = new Map(Object.entries(scripts).map(([name, text]) => [name, versionOf(text)]));
  const outputs = outputsOf(known)
    .filter((ending) => files[ending])
    .map((ending) => ({ ending, etag: versionOf(files[ending].text), size: files[ending].text.length, generation: files[ending].generation ?? null }));
  if (typeof known === "string") return { summary: summary("film", known, outputs, false), faults: [], moreFaults: 0, frames: [], keys: [] };
  const frames = known.frames.map(frameUpdate);
  const keys = frames
    .filter(({ state }) => state === "done")
    .map(({ script, version, pixels, part }) => `frames/film/${receipts.named(script, version, pixels, part)}.png`);
  const versions = await receipts.versionsOf(there, receipts.haveFiles(there, known.frames) ? found : []);
  return { summary: summary("film", known, outputs, isBehind(known, versions)), ...faults("film", known), frames, keys };
}

test("the state of a run is what the program computes", async () => {
  for (const { title, expected, ...given } of JSON.parse(readFileSync(join(root, "../src/runs/standing.json")))) {
    assert.deepEqual(JSON.parse(JSON.stringify(await computed(given))), expected, title);
  }
});
