// The page without a program, served by `rayfold dev --site` beside its bucket: a person submits and sees runs, with the rights
// that people have in a stack. `node --test`, with RAYFOLD (the program), CHROMIUM and SITE (the folder); RAYFOLD_FUNCTIONS where
// the functions are not beside the program.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";

import { chromium } from "playwright-core";

import { expected, film, linked, unzipped } from "./host.mjs";
import { load } from "./modules.mjs";
import { cognito, dev } from "./site-dev.mjs";

/** Longer than a bucket takes on a loaded machine, in milliseconds. */
const PATIENCE = 600_000;

const { CHROMIUM: executablePath } = process.env;

let browser, bucket;
before(async () => {
  // A page that the test has changed counts as one from afar, which Chromium keeps from this machine's ports.
  browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--disable-features=LocalNetworkAccessChecks"] });
  bucket = await dev();
});
after(async () => {
  await browser?.close();
  await bucket?.stop();
});

async function open(t, files, own = bucket.own) {
  const context = await browser.newContext({ viewport: { width: 1400, height: 900 }, acceptDownloads: true });
  t.after(() => context.close());
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  const faults = [];
  page.on("pageerror", (error) => faults.push(String(error)));
  await page.goto(`${own}/studio.html${linked("film", files)}`);
  await page.waitForFunction(() => document.querySelector("canvas")?.dataset.final === "true");
  return { page, faults };
}

/** Opens a link of the page by its fragment, as its menu does. */
const show = (page, hash) => page.evaluate((hash) => (location.hash = hash), hash);

async function submit(page, name) {
  await show(page, "#submit");
  await page.getByLabel("Name of the run").fill(name);
  await page.getByRole("button", { name: "Estimate the cost" }).click();
  await page.getByText(/to upload/).waitFor();
  await page.getByRole("button", { name: "Submit", exact: true }).click();
  await page.waitForURL((url) => url.hash === `#run=${encodeURIComponent(name)}`);
}

const becomes = (page, status) =>
  page.locator(`.standing [role=status][data-status=${status}][data-settled=true]`).waitFor({ timeout: PATIENCE });

async function downloaded(page, name) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name, exact: typeof name === "string" }).click()]);
  return readFileSync(await download.path());
}

const gif = (page) => downloaded(page, /Download GIF/);

test("a person submits, sees the frames and the GIF of the command, and finds the run again", async (t) => {
  const { page, faults } = await open(t, [["film.txt", film]]);
  await page.getByRole("button", { name: "More output" }).click();
  await page.locator("#more-output").getByRole("link", { name: "Submit", exact: true }).waitFor();
  await page.keyboard.press("Escape");
  await submit(page, "films/first");
  await becomes(page, "done");
  assert.equal(await page.locator(".cell[data-state=done]").count(), 6);
  await page.waitForFunction(() => document.querySelector(".cell img")?.naturalWidth === 160);
  await page.waitForFunction(() => document.querySelector("figure.gif img")?.naturalWidth === 160);
  assert.ok((await gif(page)).equals(expected(t, [["film.txt", film]])), "the same bytes");
  const zip = unzipped(await downloaded(page, "Download frames"));
  assert.deepEqual(zip.map(([name]) => name), [1, 2, 3, 4, 5, 6].map((number) => `frame${number}.png`));
  for (const [name, picture] of zip) assert.ok(picture.equals(await downloaded(page, name.replace("frame", "Frame ").replace(".png", ""))), name);
  await page.getByText("All 6 frames are in the zip file.").first().waitFor();

  await page.reload();
  await becomes(page, "done");
  await show(page, "#runs");
  await page.getByRole("link", { name: "films/first" }).waitFor();
  await page.getByText(/done: 6 of 6 frames/).waitFor();
  assert.deepEqual(faults, []);
});

test("what is submitted again is compared, and scripts that the page lacks are deleted only if the person agrees", async (t) => {
  const script = (at) => film.replace("Frames 6", "Frames 2").replace("Sphere 1 ", `Sphere 1.${at} `);
  const { page } = await open(t, [["a.txt", script(1)], ["b.txt", script(2)]]);
  await submit(page, "second");
  await becomes(page, "done");
  const other = await open(t, [["a.txt", script(1)]]);
  await show(other.page, "#submit");
  await other.page.getByLabel("Name of the run").fill("second");
  await other.page.getByRole("button", { name: "Estimate the cost" }).click();
  await other.page.getByText(/1 file to upload, 1 there already/).waitFor();
  const send = other.page.getByRole("button", { name: "Submit", exact: true });
  assert.ok(await send.isDisabled());
  await other.page.getByRole("checkbox", { name: /Delete a script of the bucket/ }).check();
  await send.click();
  await becomes(other.page, "done");
  await other.page.getByText(/done: 2 of 2 frames/).waitFor();
});

test("a script with an error is not sent, and a name that leads elsewhere is refused", async (t) => {
  const { page } = await open(t, [["film.txt", film]]);
  for (const name of ["../others", "a//b", "."]) {
    await show(page, "#submit");
    await page.getByLabel("Name of the run").fill(name);
    await page.getByRole("button", { name: "Estimate the cost" }).click();
    await page.getByRole("alert").getByText(/is no name of a run/).waitFor();
    await show(page, "");
  }
  const faulty = await open(t, [["film.txt", film], ["wrong.txt", film.replace("Sphere", "Spere")]]);
  await show(faulty.page, "#submit");
  await faulty.page.getByRole("button", { name: "Estimate the cost" }).click();
  await faulty.page.getByRole("alert").getByText(/wrong.txt has an error/).waitFor();
});

test("the cost is shown before anything is sent, and frames of different sizes are not sent", async (t) => {
  const { page } = await open(t, [["film.txt", film]]);
  await show(page, "#submit");
  await page.getByRole("button", { name: "Estimate the cost" }).click();
  await page.getByText(/6 frames of 160 × 120 pixels, [\d.]+ ms each on one thread of this machine/).waitFor();
  await page.getByText("Making it, once").click();
  await page.getByText(/Lambda: invocations: 7,/).waitFor();
  const unlike = await open(t, [["a.txt", film], ["b.txt", film.replace("160", "80")]]);
  await show(unlike.page, "#submit");
  await unlike.page.getByRole("button", { name: "Estimate the cost" }).click();
  await unlike.page.getByRole("alert").getByText(/a.txt is 160 x 120 and b.txt is 80 x 120/).waitFor();
  const few = await open(t, [["film.txt", film], ["animation.json", '{"frames": 7}']]);
  await show(few.page, "#submit");
  await few.page.getByRole("button", { name: "Estimate the cost" }).click();
  await few.page.getByRole("alert").getByText("animation.json says 7 frames, but the scripts give 6").waitFor();
});

test("a run whose scripts name files is seen as it is, also once a file is another", async (t) => {
  const model = (height) => `v -1 0 0\nv 1 0 0\nv 0 ${height} 0\nf 1 2 3\n`;
  const script = 'Screen 48 32\nLook 0 1 6  0 1 0  40\nIlight 1 1 1  1 -1 -1\nMesh "tent.obj"  .1 .1 .1  .5 .6 .7  0 0 0\nTrace\n';
  for (const height of [2, 3]) {
    const { page } = await open(t, [["1.txt", script], ["tent.obj", model(height)]]);
    await submit(page, "meshes");
    await becomes(page, "done");
    await page.getByText("done: 1 of 1 frame", { exact: true }).waitFor();
    assert.ok((await gif(page)).equals(expected(t, [["1.txt", script], ["tent.obj", model(height)]])), "the same bytes");
  }
});

test("frames that failed are drawn again, one or all of them", async (t) => {
  const own = await dev({ RAYFOLD_MAX_OBJECTS: "2" });
  t.after(own.stop);
  const ball = (x) => `Sphere 4  ${x} 8 -9  .2 .2 .2  .7 .6 .5\n`;
  const [few, many] = [`Screen 48 32\n${ball(8)}${ball(20)}Trace\n`, `Screen 48 32\n${ball(8)}${ball(20)}${ball(30)}Trace\n`];
  const scripts = [["1.txt", few], ["2.txt", many], ["3.txt", many]];
  const { page } = await open(t, scripts, own.own);
  await submit(page, "film");
  await becomes(page, "failed");
  await page.getByText("failed: 1 of 3 frames, 2 failed").waitFor();

  // With the same limit they fail again.
  await page.getByRole("button", { name: "Retry all that failed" }).click();
  await page.getByText("2 frames are drawn again.").first().waitFor();
  await becomes(page, "failed");

  // With another limit they do not.
  await own.again();
  await page.reload();
  await becomes(page, "failed");
  await page.getByRole("listitem").filter({ hasText: "3.txt" }).getByRole("button", { name: "Retry this frame" }).click();
  await page.getByText("1 frame is drawn again.").first().waitFor();
  await page.getByText("failed: 2 of 3 frames, 1 failed").waitFor({ timeout: PATIENCE });
  await page.getByRole("button", { name: "Retry all that failed" }).click();
  await becomes(page, "done");
  assert.ok((await gif(page)).equals(expected(t, scripts)), "the same bytes");
});

test("the credentials of the page end at the person's folder", async (t) => {
  const { page } = await open(t, [["film.txt", film]]);
  const { endpoint } = await page.evaluate(() => fetch("rayfold.json").then((answer) => answer.json()));
  const given = await page.evaluate(() => fetch("/credentials", { method: "POST" }).then((answer) => answer.json()));
  const { signed, encoded } = await load("static/stack/sign.ts");
  const status = async (method, key, query = "") => {
    const url = new URL(`${endpoint}/${key.split("/").map(encoded).join("/")}${query}`);
    const body = method === "PUT" ? { body: new Uint8Array([1]) } : {};
    return (await fetch(url, { method, headers: await signed({ method, url, ...body }, given, "us-east-1"), ...body })).status;
  };
  const list = (prefix) => status("GET", "", `?list-type=2&prefix=${encoded(prefix)}`);
  for (const folder of ["scripts", "frames", "manifests"]) assert.equal(await list(`${folder}/${given.identity}/`), 200);
  assert.equal(await status("PUT", `scripts/${given.identity}/mine/1.txt`), 200);
  assert.equal(await status("DELETE", `scripts/${given.identity}/mine/1.txt`), 204);
  for (const prefix of ["", "scripts/", `scripts/${given.identity}`, "scripts/local:1/", "frames/", `frames/${given.identity}`, `retries/${given.identity}/`, `parts/${given.identity}/`]) assert.equal(await list(prefix), 403, prefix);
  const frame = `${given.identity}/mine/1@v-p1`;
  assert.equal(await status("PUT", `retries/${frame}/1`), 200);
  for (const kind of ["error.json", "begun-1"]) assert.equal(await status("DELETE", `frames/${frame}.${kind}`), 204);
  for (const kind of ["png", "taken", "cut-2", "1-of-2.band"]) assert.equal(await status("DELETE", `frames/${frame}.${kind}`), 403, kind);
  for (const kind of ["png", "error.json", "begun-1"]) assert.equal(await status("PUT", `frames/${frame}.${kind}`), 403, kind);
  for (const method of ["GET", "DELETE"]) assert.equal(await status(method, `retries/${frame}/1`), 403, method);
  for (const name of ["2", "11", "1/x"]) assert.equal(await status("PUT", `retries/${frame}/${name}`), 403, name);
  for (const key of ["retries/a/1@v-p1/1", "retries/local:1/a/1@v-p1/1", "frames/local:1/a/1@v-p1.error.json", `frames/${given.identity}/mine/@assembler.json`, "scripts/a/1.txt", "scripts/local:1/a/1.txt", "manifests/a.json", `manifests/${given.identity}.json`, `parts/${given.identity}/a`]) {
    for (const method of ["GET", "HEAD", "PUT", "DELETE"]) assert.equal(await status(method, key), 403, `${method} ${key}`);
  }
});

test("a person signs in on another page, comes back, and submits with the credentials of the identity", async (t) => {
  const { own } = bucket;
  const stand = await cognito(own);
  const { asked } = stand;
  const context = await browser.newContext({ viewport: { width: 1400, height: 900 }, serviceWorkers: "block" });
  t.after(() => context.close());
  await context.route("**", async (route) => {
    const request = route.request();
    const answer = await stand.answer(request.method(), request.url(), request.headers(), request.postData());
    return answer ? route.fulfill(answer) : route.continue();
  });
  const page = await context.newPage();
  page.setDefaultTimeout(60_000);
  const blocked = [];
  page.on("console", (message) => /Content Security Policy/.test(message.text()) && blocked.push(message.text()));
  const drawn = () => page.waitForFunction(() => document.querySelector("canvas")?.dataset.final === "true");
  await page.goto(`${own}/studio.html${linked("film", [["film.txt", film]])}`);
  await drawn();
  assert.deepEqual(asked, [], "nobody is asked before there is a need");
  // An answer to another question than the page's is not used, and the browser is not sent away again by itself.
  stand.isStateRight = false;
  await show(page, "#submit");
  await page.getByRole("link", { name: "Sign in" }).click();
  await page.getByRole("alert").getByText(/nobody was signed in/).waitFor();
  assert.deepEqual(asked, ["password"]);
  stand.isStateRight = true;
  await show(page, "#runs");
  await page.getByRole("link", { name: "Sign in" }).click();
  await page.getByRole("heading", { name: "Runs in rayfold" }).waitFor();
  await drawn();
  await submit(page, "signed");
  await becomes(page, "done");
  assert.equal(asked.filter((what) => what === "token").length, 1);
  assert.deepEqual(asked.slice(-3), ["token", "GetId", "GetCredentialsForIdentity"]);
  assert.equal(new URL(page.url()).search, "", "the code is gone from the address");
  assert.deepEqual(blocked, []);
});
