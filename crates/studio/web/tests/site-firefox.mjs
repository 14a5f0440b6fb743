// The studio without a server in Firefox, driven by WebDriver BiDi: as `site.mjs`, with FIREFOX.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import puppeteer from "puppeteer-core";

import { expected, film, linked, many, serve, unzipped } from "./host.mjs";
import { cognito, dev } from "./site-dev.mjs";

let browser, host;
before(async () => {
  browser = await puppeteer.launch({ browser: "firefox", executablePath: process.env.FIREFOX, headless: true });
  host = await serve();
});
after(async () => {
  await browser?.close();
  host?.close();
});

async function open(t, where, shown, prepare = () => {}) {
  const context = await browser.createBrowserContext();
  const page = await context.newPage();
  await page.setViewport({ width: 1400, height: 900 });
  // Keeps what the page saves.
  await page.evaluateOnNewDocument(() => {
    const { createObjectURL } = URL;
    URL.createObjectURL = (blob) => {
      if (blob.type === "") globalThis.saved = blob;
      return createObjectURL(blob);
    };
  });
  const faults = [];
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  t.after(() => context.close());
  await prepare(page);
  await page.goto(new URL(where, host.address).href);
  const drawn = (what = "canvas[data-final=true]") => page.waitForSelector(what, { timeout: 120_000 });
  await drawn(shown);
  return { page, drawn, check: () => assert.deepEqual(faults, []) };
}

async function gif(page) {
  await page.click("::-p-aria(Render GIF)");
  return saved(page, ".result a.button");
}

async function saved(page, link) {
  await page.evaluate(() => void (globalThis.saved = null));
  await (await page.waitForSelector(link, { timeout: 120_000 })).click();
  await page.waitForFunction(() => globalThis.saved);
  const text = await page.evaluate(async () => {
    const bytes = new Uint8Array(await globalThis.saved.arrayBuffer());
    return btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  });
  return Buffer.from(text, "base64");
}

test("in Firefox a link with 200 scripts becomes the command's GIF, and is kept", async (t) => {
  const { page, drawn, check } = await open(t, `studio.html${linked("many", many)}`);
  assert.ok((await gif(page)).equals(expected(t, many)), "the same bytes");
  assert.equal(new URL(page.url()).hash, "#project=many");
  await page.reload();
  await drawn();
  await page.waitForSelector("::-p-text(frame 1 of 200)");
  check();
});

test("in Firefox curves and samples become the command's GIF, and an object is dragged", async (t) => {
  const { page, check } = await open(t, `studio.html${linked("film", [["film.txt", film]])}`);
  assert.ok((await gif(page)).equals(expected(t, [["film.txt", film]])), "the same bytes");
  const text = () => page.$eval(">>> .cm-content", (content) => content.textContent);
  const before = await text();
  const box = await (await page.$("canvas")).boundingBox();
  await page.mouse.move(box.x + box.width * 0.2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.4, box.y + box.height / 2, { steps: 8 });
  await page.mouse.up();
  assert.notEqual(await text(), before);
  check();
});

test("in Firefox the start page shows an example playing, and a click opens it", async (t) => {
  const { page, drawn, check } = await open(t, "", "img");
  const hello = await page.waitForSelector("::-p-aria(hello)", { timeout: 120_000 });
  const looks = new Set();
  for (let look = 0; look < 20 && looks.size < 3; look++) {
    looks.add(await hello.screenshot({ encoding: "base64" }));
    await new Promise((done) => setTimeout(done, 100));
  }
  assert.equal(looks.size, 3, "pictures that were seen");
  await hello.click();
  await drawn();
  assert.match(page.url(), /studio\.html#project=hello$/);
  check();
});

test("in Firefox a person signs in on another page, comes back, submits, has the command's GIF, and finds the run", async (t) => {
  const { own, stop } = await dev();
  t.after(stop);
  const stand = await cognito(own);
  const { page, drawn, check } = await open(t, `${own}/studio.html${linked("film", [["film.txt", film]])}`, undefined, async (page) => {
    // What a service worker fetches is not answered here.
    await page.evaluateOnNewDocument(() => {
      if (navigator.serviceWorker) navigator.serviceWorker.register = () => new Promise(() => {});
    });
    await page.setRequestInterception(true);
    page.on("request", async (request) => {
      // Firefox gives no bodies of requests.
      const answer = await stand.answer(request.method(), request.url(), request.headers());
      await (answer ? request.respond(answer) : request.continue());
    });
  });
  assert.deepEqual(stand.asked, [], "nobody is asked before there is a need");
  const show = (hash) => page.evaluate((hash) => void (location.hash = hash), hash);
  const click = async (what) => (await page.waitForSelector(what, { timeout: 120_000 })).click();
  await show("#runs");
  await click("::-p-aria(Sign in)");
  await page.waitForSelector("::-p-text(Runs in rayfold)", { timeout: 120_000 });
  assert.deepEqual(stand.asked, ["password", "token", "GetId", "GetCredentialsForIdentity"]);
  await show("#submit");
  await page.waitForSelector("form.submit input.rename", { timeout: 120_000 });
  // At once: puppeteer clears the field without an event first, and types into what the page has drawn meanwhile.
  await page.$eval("form.submit input.rename", (input) => {
    input.value = "signed";
    input.dispatchEvent(new Event("input", { bubbles: true }));
  });
  await click("form.submit button.main:not(:disabled)");
  await page.waitForSelector("::-p-text(to upload)", { timeout: 120_000 });
  await page.waitForSelector("::-p-text(6 frames of 160 × 120 pixels)");
  await page.waitForSelector("::-p-text(Making it, once)");
  await click("form.submit button.main:not(:disabled)");
  await drawn(".standing [role=status][data-status=done][data-settled=true]");
  assert.equal(new URL(page.url()).hash, "#run=signed");
  assert.ok((await saved(page, "a[download$='.gif']")).equals(expected(t, [["film.txt", film]])), "the same bytes");
  assert.deepEqual(unzipped(await saved(page, "a[download$='-frames.zip']")).map(([name]) => name), [1, 2, 3, 4, 5, 6].map((at) => `frame${at}.png`));
  await show("#runs");
  await page.waitForSelector("a[href='#run=signed']", { timeout: 120_000 });
  await page.waitForSelector("::-p-text(done: 6 of 6 frames)", { timeout: 120_000 });
  check();
});

test("in Firefox the studio draws after the host has gone", async (t) => {
  const { page, drawn, check } = await open(t, "studio.html");
  await page.evaluate(async () => void (await navigator.serviceWorker.ready));
  host.close();
  await page.reload();
  await drawn();
  check();
});
