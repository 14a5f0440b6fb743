// The studio without a server, as `cargo xtask site` has built it: `node --test`, with RAYFOLD (the program), CHROMIUM and
// SITE (the folder). With EXAMPLES=all it opens every example.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { chromium } from "playwright-core";

import { expected, film, linked, many, serve } from "./host.mjs";

const { CHROMIUM: executablePath, EXAMPLES, SITE: site } = process.env;

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
  host = await serve(FAULTY);
  ({ address } = host);
});
after(async () => {
  await browser?.close();
  host?.close();
});

async function open(t, where, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1400, height: 900 }, acceptDownloads: true, ...options });
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

async function gif(page) {
  await page.getByRole("button", { name: "Render GIF" }).click();
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: /Download GIF/ }).click()]);
  return readFileSync(await download.path());
}

test("a link with 200 scripts opens, is kept, and becomes the command's GIF", async (t) => {
  const { page, drawn, check } = await open(t, `studio.html${linked("many", many)}`);
  await drawn();
  await page.locator("output", { hasText: "frame 1 of 200" }).waitFor();
  assert.ok((await gif(page)).equals(expected(t, many)), "the same bytes");
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
  const damaged = { name: "damaged.zip", mimeType: "application/zip", buffer: Buffer.from("PK is not enough") };
  await page.getByLabel("Open a project").setInputFiles(damaged);
  await page.locator(".places").getByText(/the zip file cannot be used/).waitFor();
  const chosen = { name: "again.zip", mimeType: "application/zip", buffer: readFileSync(await zip.path()) };
  await page.getByLabel("Open a project").setInputFiles(chosen);
  await page.waitForURL(/#project=again$/);
  await page.locator("output", { hasText: "frame 1 of 6" }).waitFor();
  check();
});

test("a model is added to a project, and drawn by a script that names it", async (t) => {
  const tent = 'Screen 48 32\nLook 0 1 6  0 1 0  40\nIlight 1 1 1  1 -1 -1\nMesh "tent.obj"  .1 .1 .1  .5 .6 .7  0 0 0\nTrace\n';
  const model = "v -1 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n";
  const { page, drawn, check } = await open(t, `studio.html${linked("film", [["a.txt", film]])}`);
  await drawn();
  await page.getByRole("button", { name: "File", exact: true }).click();
  const file = (name, text) => ({ name, mimeType: "application/octet-stream", buffer: Buffer.from(text) });
  await page.getByLabel("Add files").setInputFiles([file("tent.obj", model)]);
  await page.getByText("tent.obj can be named by the scripts of the project.").first().waitFor();
  page.on("dialog", (dialog) => void dialog.accept());
  await page.getByLabel("Add files").setInputFiles([file("a.txt", tent), file("b.txt", tent)]);
  await page.locator("output", { hasText: "frame 1 of 2" }).waitFor();
  await drawn();
  assert.ok((await gif(page)).equals(expected(t, [["a.txt", tent], ["b.txt", tent], ["tent.obj", model]])), "the same bytes");
  check();
});

test("a second page of a project takes over with what was typed last, and the first one says so", async (t) => {
  const { page, context, drawn } = await open(t, `studio.html${linked("film", [["film.txt", film]])}`);
  await drawn();
  await page.locator(".cm-content").click();
  await page.keyboard.press("Control+Home");
  const other = await context.newPage();
  // The other page reads before this one would write by itself.
  await other.goto(`${address}studio.html`);
  await other.waitForFunction(() => document.querySelector("canvas")?.dataset.final === "true");
  await page.getByText("Another page has taken over").waitFor();
  await page.getByRole("link", { name: "Open the page again" }).click();
  await drawn();
  await other.getByText("Another page has taken over").waitFor();
  await page.locator(".cm-content").click();
  await page.keyboard.press("Control+Home");
  await page.keyboard.type("# typed last\n");
  await other.getByRole("link", { name: "Open the page again" }).click();
  await other.locator(".cm-content", { hasText: "typed last" }).waitFor();
});

for (const [what, hash, why] of [
  ["is cut off", linked("film", [["film.txt", film]]).slice(0, -20), /the link is damaged or cut off/],
  ["is no link", "#scene=%%%", /the link is damaged or cut off/],
  ["is damaged", "#project=%E0%A4%A", /the address is damaged/],
  ["leads out of the storage", "#project=..", /.. is no name of a project/],
  ["names no example", "#example=..%2Fx", /there is no example/],
  ["has settings with an error", linked("film", [["film.txt", film], ["animation.json", "{"]]), /animation.json:1/],
]) {
  test(`an address that ${what} is refused with its reason, and a new project is a click away`, async (t) => {
    const { page, drawn } = await open(t, `studio.html${hash}`);
    await page.getByText(why).first().waitFor();
    await page.getByRole("button", { name: "Open a new project" }).click();
    await page.waitForURL(/#project=scene/);
    await drawn();
  });
}

test("files of a link whose names lead elsewhere are left out, by name", async (t) => {
  const { page, drawn, check } = await open(t, `studio.html${linked("../up", [["../up.txt", film], ["a/b.txt", film], [".c.txt", film], ["d.txt", film]])}`);
  await page.getByText(/are left out, because their names are none of a folder: ..\/up.txt, a\/b.txt, .c.txt/).waitFor();
  await drawn();
  assert.equal(new URL(page.url()).hash, "#project=-up");
  check();
});

test("with a full storage the page says what is not kept, and keeps it once there is room", async (t) => {
  const { page, context, drawn, check } = await open(t, `studio.html${linked("film", [["film.txt", film]])}`);
  await drawn();
  const devtools = await context.newCDPSession(page);
  const origin = address.slice(0, -1);
  await devtools.send("Storage.overrideQuotaForOrigin", { origin, quotaSize: 1 });
  await page.locator(".cm-content").click();
  await page.keyboard.press("Control+Home");
  await page.keyboard.type(`# ${"long ".repeat(50)}\n`);
  await page.getByText(/film.txt cannot be written: .*quota/).waitFor();
  await page.evaluate((hash) => (location.hash = hash), linked("other", [["other.txt", film]]));
  await page.reload();
  await page.getByText(/This browser keeps no files: .*quota/).waitFor();
  await drawn();
  await devtools.send("Storage.overrideQuotaForOrigin", { origin });
  await page.evaluate((hash) => (location.hash = hash), linked("other", [["other.txt", film]]));
  await page.reload();
  await page.waitForURL(/#project=other/);
  await drawn();
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

test("after the start page was loaded, an example opens and is drawn without a network", async (t) => {
  const { page, context, drawn, check } = await open(t, "");
  await page.evaluate(() => navigator.serviceWorker.ready);
  await context.setOffline(true);
  await page.getByRole("link", { name: "hello" }).click();
  await page.waitForURL(/studio\.html#project=hello$/);
  await drawn();
  check();
});

test("the studio leads back to the start page", async (t) => {
  const { page, drawn, check } = await open(t, "studio.html");
  await drawn();
  await page.getByRole("link", { name: "Start page" }).click();
  await page.getByRole("heading", { name: "Examples" }).waitFor();
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

for (const reducedMotion of ["no-preference", "reduce"]) {
  const isStill = reducedMotion === "reduce";
  test(`the start page shows each example ${isStill ? "still, where people want that" : "playing"}, and a click opens it`, async (t) => {
    const { page, drawn, check } = await open(t, "", { reducedMotion });
    const shown = page.locator("li img");
    assert.equal(await shown.count(), all.length);
    for (const image of await shown.all()) {
      await image.scrollIntoViewIfNeeded();
      await image.evaluate((image) => image.decode());
      if (isStill) assert.match(await image.evaluate((image) => image.currentSrc), /\.png$/);
    }
    const hello = page.getByRole("link", { name: "hello" });
    await hello.scrollIntoViewIfNeeded();
    const looks = new Set();
    for (let look = 0; look < 20 && looks.size < 3; look++) {
      looks.add(String(await hello.screenshot()));
      await page.waitForTimeout(100);
    }
    assert.equal(looks.size, isStill ? 1 : 3, "pictures that were seen");
    await hello.click();
    await page.waitForURL(/studio\.html#project=hello$/);
    await drawn();
    check();
  });
}

const all = readdirSync(join(site, "examples")).filter((file) => file.endsWith(".zip")).map((file) => file.replace(".zip", ""));
// One of plain objects, one with a model, and one with letters and samples.
for (const example of EXAMPLES === "all" ? all : ["hello", "chess", "logo"]) {
  test(`a picture of the example ${example} appears`, async (t) => {
    const { page, check } = await open(t, `studio.html#example=${example}`);
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
