// The studio without a server, as `cargo xtask site` has built it: `node --test`, with RAYFOLD (the program), CHROMIUM and
// SITE (the folder).

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { createReadStream, existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { extname, join } from "node:path";
import { after, before, test } from "node:test";
import { deflateRawSync } from "node:zlib";

import { chromium } from "playwright-core";

const { RAYFOLD: program, CHROMIUM: executablePath, SITE: site } = process.env;
const KINDS = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".wasm": "application/wasm" };
const film =
  "Screen 160 120\nSamples 4\nFrames 6\nLook 0 2 8  0 1 0  40\nIlight 1 1 1  1 -2 -1\nSphere 1  (1:-2 6:2) 1 0  .1 .1 .1  .5 .6 .7  .4 .4 .4\nTrace\n";

/** What goes before the workers' program in the address with `faulty`: drawing a second frame ends the module, as a panic does. */
const FAULTY = `{
  const Instance = WebAssembly.Instance;
  WebAssembly.Instance = function (module, imports) {
    const { exports } = new Instance(module, imports);
    let at = 0, size = 0;
    const input = (length) => (at = exports.input((size = length)));
    const call = (what, ...rest) => {
      const task = what === 11 ? new TextDecoder().decode(new Uint8Array(exports.memory.buffer, at, size)) : "";
      if (/"frame":1\\b/.test(task)) throw new WebAssembly.RuntimeError("unreachable");
      return exports.call(what, ...rest);
    };
    return { exports: { ...exports, input, call } };
  };
}
`;

let browser, host, address;
before(async () => {
  browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
  host = createServer((request, response) => {
    const asked = new URL(request.url, "http://host").pathname.replace(/\/$/, "/index.html");
    const path = join(site, asked.replace("/faulty/", "/"));
    if (!existsSync(path)) return response.writeHead(404).end();
    response.writeHead(200, { "content-type": KINDS[extname(path)] ?? "application/octet-stream" });
    if (asked === "/faulty/worker.js") response.end(FAULTY + readFileSync(path));
    else createReadStream(path).pipe(response);
  });
  await new Promise((done) => host.listen(0, "127.0.0.1", done));
  address = `http://127.0.0.1:${host.address().port}/`;
});
after(async () => {
  await browser?.close();
  host?.closeAllConnections();
  host?.close();
});

async function open(t, where) {
  const context = await browser.newContext({ viewport: { width: 1400, height: 900 }, acceptDownloads: true });
  const page = await context.newPage();
  const faults = [];
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  page.on("request", (sent) => {
    if (!sent.url().startsWith(address) && !/^(data|blob):/.test(sent.url())) faults.push(`outside: ${sent.url()}`);
  });
  t.after(() => context.close());
  await page.goto(address + where);
  const drawn = () => page.waitForFunction(() => document.querySelector("canvas")?.dataset.final === "true");
  return { page, context, drawn, check: () => assert.deepEqual(faults, []) };
}

/** The fragment of a link, as the page makes it. */
function linked(name, files) {
  const parts = [[name, ""], ...files].flat().map((part) => Buffer.from(part));
  const bytes = Buffer.concat(parts.flatMap((part) => [Buffer.from(Uint32Array.of(part.length).buffer), part]));
  return `#scene=${deflateRawSync(bytes).toString("base64url")}`;
}

async function gif(page) {
  await page.getByRole("button", { name: "Render GIF" }).click();
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: /Download GIF/ }).click()]);
  return readFileSync(await download.path());
}

function expected(t, files) {
  const folder = mkdtempSync(join(tmpdir(), "rayfold-site-"));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  for (const [name, text] of files) writeFileSync(join(folder, name), text);
  const out = join(folder, "out.gif");
  const run = spawnSync(program, ["render", folder, "-o", out]);
  assert.equal(run.status, 0, String(run.stderr));
  return readFileSync(out);
}

test("a link with 200 scripts opens, is kept, and becomes the command's GIF", async (t) => {
  const files = Array.from({ length: 200 }, (_, at) => [
    `f${at + 1}.txt`,
    `Screen 48 32\nLook 0 1 6  0 0 0  50\nIlight 1 1 1  1 -1 -1\nSphere 1  ${(at - 100) / 100} 0 0  0.2 0.1 0.1  0.7 0.5 0.3\nTrace\n`,
  ]);
  const { page, drawn, check } = await open(t, `studio.html${linked("many", files)}`);
  await drawn();
  await page.locator("output", { hasText: "frame 1 of 200" }).waitFor();
  assert.ok((await gif(page)).equals(expected(t, files)), "the same bytes");
  assert.equal(new URL(page.url()).hash, "#project=many");
  await page.reload();
  await page.locator("output", { hasText: "frame 1 of 200" }).waitFor();
  check();
});

test("curves and samples become the command's GIF, and a zip file holds the project", async (t) => {
  const { page, drawn, check } = await open(t, `studio.html${linked("film", [["film.txt", film]])}`);
  await drawn();
  assert.ok((await gif(page)).equals(expected(t, [["film.txt", film]])), "the same bytes");
  await page.getByRole("button", { name: "File", exact: true }).click();
  const [zip] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save as zip" }).click()]);
  assert.equal(zip.suggestedFilename(), "film.zip");
  const chosen = { name: "again.zip", mimeType: "application/zip", buffer: readFileSync(await zip.path()) };
  await page.getByLabel("Open a project").setInputFiles(chosen);
  await page.waitForURL(/#project=again$/);
  await page.locator("output", { hasText: "frame 1 of 6" }).waitFor();
  check();
});

test("after the first load the studio opens and draws without a network", async (t) => {
  const { page, context, drawn, check } = await open(t, "studio.html");
  await drawn();
  await page.evaluate(() => navigator.serviceWorker.ready);
  await page.reload();
  await drawn();
  await context.setOffline(true);
  await page.reload();
  await drawn();
  check();
});

test("the page says that a worker failed, and a new one draws", async (t) => {
  const { page, drawn, check } = await open(t, `faulty/studio.html${linked("film", [["film.txt", film]])}`);
  await drawn();
  const before = await page.evaluate(() => document.querySelector("canvas").toDataURL());
  await page.keyboard.press(".");
  await page.getByText(/the tracer has failed: RuntimeError: unreachable/).first().waitFor();
  await page.keyboard.press(".");
  await page.locator("output", { hasText: "frame 3 of 6" }).waitFor();
  await page.waitForFunction((before) => document.querySelector("canvas").toDataURL() !== before, before);
  await drawn();
  check();
});

for (const file of readdirSync(join(site, "examples")).filter((file) => file.endsWith(".zip"))) {
  test(`a picture of the example ${file} appears`, async (t) => {
    const { page, check } = await open(t, `studio.html#example=${file.replace(".zip", "")}`);
    // Slow ones are refined for minutes: a first picture is enough.
    const isPicture = () => {
      const canvas = document.querySelector("canvas");
      if (!canvas?.width || !canvas.height) return false;
      const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
      copy.drawImage(canvas, 0, 0);
      const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
      return new Set(new Uint32Array(data.buffer)).size > 16;
    };
    await page.waitForFunction(isPicture, null, { timeout: 60000, polling: 250 });
    assert.equal(await page.getByText(/tracer has failed/).count(), 0);
    check();
  });
}
