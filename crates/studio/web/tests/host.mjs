// A host for the site that `cargo xtask site` has built, and what its tests in all browsers share.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { createReadStream, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { extname, join } from "node:path";
import { crc32, deflateRawSync } from "node:zlib";

const { RAYFOLD: program, SITE: site } = process.env;
const KINDS = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm" };

export const film =
  "Screen 160 120\nSamples 4\nFrames 6\nLook 0 2 8  0 1 0  40\nIlight 1 1 1  1 -2 -1\nSphere 1  (1:-2 6:2) 1 0  .1 .1 .1  .5 .6 .7  .4 .4 .4\nTrace\n";

/** Serves the site, compressed as hosts of files do. `before` is what goes before the workers' program in the folder `faulty`. */
export async function serve(before = "") {
  const host = createServer((request, response) => {
    const asked = new URL(request.url, "http://host").pathname.replace(/\/$/, "/index.html");
    const path = join(site, asked.replace("/faulty/", "/"));
    if (!existsSync(path)) return response.writeHead(404).end();
    const isPacked = existsSync(`${path}.br`) && asked !== "/faulty/worker.js";
    const encoding = isPacked ? { "content-encoding": "br" } : {};
    response.writeHead(200, { "content-type": KINDS[extname(path)] ?? "application/octet-stream", ...encoding });
    if (asked === "/faulty/worker.js") response.end(before + readFileSync(path));
    else createReadStream(isPacked ? `${path}.br` : path).pipe(response);
  });
  await new Promise((done) => host.listen(0, "127.0.0.1", done));
  const close = () => {
    host.closeAllConnections();
    host.close();
  };
  return { address: `http://127.0.0.1:${host.address().port}/`, close };
}

/** The fragment of a link, as the page makes it. */
export function linked(name, files) {
  const parts = [[name, ""], ...files].flat().map((part) => Buffer.from(part));
  const bytes = Buffer.concat(parts.flatMap((part) => [Buffer.from(Uint32Array.of(part.length).buffer), part]));
  return `#scene=${deflateRawSync(bytes).toString("base64url")}`;
}

/** A folder of many small scripts. */
export const many = Array.from({ length: 200 }, (_, at) => [
  `f${at + 1}.txt`,
  `Screen 48 32\nLook 0 1 6  0 0 0  50\nIlight 1 1 1  1 -1 -1\nSphere 1  ${(at - 100) / 100} 0 0  0.2 0.1 0.1  0.7 0.5 0.3\nTrace\n`,
]);

/** The GIF of the command. */
export function expected(t, files) {
  const folder = mkdtempSync(join(tmpdir(), "rayfold-site-"));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  for (const [name, text] of files) writeFileSync(join(folder, name), text);
  const out = join(folder, "out.gif");
  const run = spawnSync(program, ["render", folder, "-o", out]);
  assert.equal(run.status, 0, String(run.stderr));
  return readFileSync(out);
}

/** The files of a zip file that stores them, by its directory. */
export function unzipped(zip) {
  const end = zip.lastIndexOf(Buffer.from("PK\x05\x06"));
  let at = zip.readUInt32LE(end + 16);
  return Array.from({ length: zip.readUInt16LE(end + 10) }, () => {
    const [crc, size, name, place] = [zip.readUInt32LE(at + 16), zip.readUInt32LE(at + 24), zip.readUInt16LE(at + 28), zip.readUInt32LE(at + 42)];
    const text = String(zip.subarray(at + 46, at + 46 + name));
    const start = place + 30 + zip.readUInt16LE(place + 26) + zip.readUInt16LE(place + 28);
    const content = zip.subarray(start, start + size);
    assert.equal(crc32(content), crc, text);
    at += 46 + name + zip.readUInt16LE(at + 30) + zip.readUInt16LE(at + 32);
    return [text, content];
  });
}
