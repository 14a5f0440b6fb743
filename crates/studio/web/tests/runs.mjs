// Submits from the page to a bucket of `rayfold dev`, in a real browser: `node --test`, with RAYFOLD (the program) and
// CHROMIUM; RAYFOLD_FUNCTIONS where the functions are not beside the program.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { test } from "node:test";

import { start } from "./processes.mjs";
import { audit, caret, open, output, program, scenes, setLine, shot, until } from "./stage.mjs";

/** Longer than a bucket takes on a loaded machine, in milliseconds. */
const PATIENCE = 600_000;

/** A bucket with its functions; what a user would export. */
async function dev(t, { data, port = 0, env = {} } = {}) {
  const folder = data ?? mkdtempSync(join(tmpdir(), "rayfold-dev-"));
  const { server, ended, said } = start(program, ["dev", "--data", folder, "--address", `127.0.0.1:${port}`], env);
  let running = true;
  const stop = async () => {
    if (running) server.kill("SIGINT");
    running = false;
    await ended;
  };
  t.after(async () => {
    await stop();
    rmSync(folder, { recursive: true, force: true });
  });
  const out = await said((text) => text.includes("aws s3 sync"));
  const exports = Object.fromEntries([...out.matchAll(/^export (\w+)=(.*)$/gm)].map(([, name, value]) => [name, value]));
  return { folder, exports, stop, port: new URL(exports.AWS_ENDPOINT_URL).port };
}

/** A page with the bucket; `heard` is all text that came to it. */
async function studio(t, exports, options) {
  const opened = await open(t, { ...options, args: ["--bucket", "rayfold"], env: exports });
  const heard = [];
  const listen = (page) => {
    page.on("response", async (answer) => {
      heard.push(JSON.stringify(answer.headers()));
      if (/json|event-stream|html|javascript/.test(answer.headers()["content-type"] ?? "")) {
        heard.push(await answer.text().catch(() => ""));
      }
    });
    page.on("websocket", (socket) => socket.on("framereceived", ({ payload }) => heard.push(payload.toString("latin1"))));
  };
  listen(opened.page);
  await opened.page.reload();
  return { ...opened, heard, listen };
}

async function submit(page, name) {
  const isOpen = (await page.locator("dialog.runs").count()) > 0;
  const link = isOpen ? page.locator("dialog.runs").getByRole("link", { name: "Submit", exact: true }) : await output(page, "Submit");
  await link.click();
  if (name) await page.getByLabel("Name of the run").fill(name);
  await page.getByRole("button", { name: "Estimate the cost" }).click();
  await page.getByText("Making it, once").waitFor();
  await page.getByRole("button", { name: "Submit", exact: true }).click();
  await until(() => page.url().includes("#run="));
}

const status = (page) => page.locator(".standing [role=status]").getAttribute("data-status");
const cells = (page, state) => page.locator(`.cell[data-state=${state}]`).count();

/** Waits until the run is what it becomes, and is settled. */
async function becomes(page, wanted) {
  await until(async () => {
    const place = page.locator(".standing [role=status]");
    if ((await place.count()) === 0) return false;
    return (await place.getAttribute("data-status")) === wanted && (await place.getAttribute("data-settled")) === "true";
  }, PATIENCE);
}

async function downloaded(page, link) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: link, exact: typeof link === "string" }).click()]);
  return readFileSync(await download.path());
}

function rendered(path, folder) {
  const out = join(folder, "expected.gif");
  const run = spawnSync(program, ["render", path, "-o", out]);
  assert.equal(run.status, 0, String(run.stderr));
  return readFileSync(out);
}

/** How many files a zip archive says that it has. */
function filesOfZip(bytes) {
  assert.equal(bytes.subarray(0, 2).toString(), "PK");
  const end = bytes.lastIndexOf(Buffer.from([0x50, 0x4b, 5, 6]));
  return bytes.readUInt16LE(end + 10);
}

test("a run goes on without its page, and gives the GIF of the command line", async (t) => {
  const bucket = await dev(t);
  const { page, context, path, folder, address, check, heard, listen } = await studio(t, bucket.exports, { from: join(scenes, "hello"), name: "hello" });
  await (await output(page, "Submit")).click();
  await page.getByRole("button", { name: "Estimate the cost" }).click();
  await page.getByText("50 frames of 512").waitFor();
  await page.getByText("To scripts/hello/: 51 files to upload, 0 there already").waitFor();
  await page.getByText("Making it, once").click();
  await page.getByText("Lambda: rendering").waitFor();
  await shot(page, "submit");
  assert.deepEqual(await audit(page), []);
  await page.getByRole("button", { name: "Submit", exact: true }).click();
  await until(async () => (await cells(page, "done")) > 0, PATIENCE);
  assert.notEqual(await status(page), "done", "it is under way");
  await shot(page, "run-under-way");
  assert.equal(page.url(), `${address}#run=hello`);
  await page.close();

  const again = await context.newPage();
  listen(again);
  await again.goto(`${address}#run=hello`);
  await becomes(again, "done");
  await again.getByText("done: 50 of 50 frames").waitFor();
  await until(() => again.locator(".gif img").evaluate((image) => image.complete && image.naturalWidth > 0));
  await until(() => again.locator(".cell img").first().evaluate((image) => image.complete && image.naturalWidth > 0));
  await shot(again, "run-done");
  assert.deepEqual(await audit(again), []);
  assert.ok((await downloaded(again, /Download GIF/)).equals(rendered(path, folder)), "the same bytes");
  assert.equal(filesOfZip(await downloaded(again, "Download frames")), 50);
  assert.equal(String((await downloaded(again, "Frame 1")).subarray(1, 4)), "PNG");
  await again.getByRole("link", { name: "All runs" }).click();
  await again.getByText("done: 50 of 50 frames").waitFor();
  await again.getByRole("link", { name: "hello", exact: true }).waitFor();
  assert.deepEqual(await audit(again), []);
  await again.getByRole("button", { name: "Back to the scene" }).click();
  await until(async () => !(await again.locator("dialog").isVisible()));
  const all = heard.join("\n");
  assert.ok(all.includes("scripts/hello/"), "what was sent to the page was heard");
  for (const name of ["AWS_SECRET_ACCESS_KEY", "AWS_ACCESS_KEY_ID"]) {
    assert.ok(bucket.exports[name].length > 5 && !all.includes(bucket.exports[name]), `${name} never reaches the page`);
  }
  check();
});

test("a frame that cannot be drawn opens its line, and is drawn again once that is mended", async (t) => {
  const ball = (x) => `Sphere 4  ${x} 8 -9  .2 .2 .2  .7 .6 .5\n`;
  const few = `Screen 48 32\n${ball(8)}${ball(20)}Trace\n`;
  const many = `Screen 48 32\n${ball(8)}${ball(20)}   ${ball(30)}Trace\n`;
  const from = mkdtempSync(join(tmpdir(), "rayfold-film-"));
  t.after(() => rmSync(from, { recursive: true, force: true }));
  for (const [name, text] of Object.entries({ "1.txt": few, "2.txt": many, "3.txt": many })) writeFileSync(join(from, name), text);
  const bucket = await dev(t, { env: { RAYFOLD_MAX_OBJECTS: "2" } });
  const { page, path, folder, saved } = await studio(t, bucket.exports, { from, name: "film" });
  await submit(page);
  await becomes(page, "failed");
  await page.getByText("failed: 1 of 3 frames, 2 failed").waitFor();
  assert.deepEqual([await cells(page, "done"), await cells(page, "failed")], [1, 2]);
  const opens = page.getByRole("button", { name: "Open 2.txt, line 4, column 4" });
  await opens.waitFor();
  await shot(page, "run-failed");
  assert.deepEqual(await audit(page), []);
  await opens.click();
  await page.locator("output", { hasText: "frame 2 of 3" }).waitFor();
  const place = { text: `   ${ball(30).trim()}`, column: 3 };
  await until(async () => JSON.stringify(await caret(page)) === JSON.stringify(place));

  // Mended and submitted again: what failed is drawn, the other frame still fails.
  await setLine(page, 4, `# ${ball(30).trim()}`);
  await until(() => readFileSync(join(path, "2.txt"), "utf8").includes("\n# Sphere"));
  await submit(page);
  await page.getByText("failed: 2 of 3 frames, 1 failed").waitFor({ timeout: PATIENCE });
  await becomes(page, "failed");
  assert.equal(await page.getByRole("button", { name: /^Open 2.txt/ }).count(), 0);

  // Functions with another limit: the frame is retried.
  await bucket.stop();
  await dev(t, { data: bucket.folder, port: bucket.port });
  await page.getByRole("button", { name: "Retry this frame" }).click();
  await becomes(page, "done");
  assert.ok((await downloaded(page, /Download GIF/)).equals(rendered(path, folder)), "the same bytes");

  // Another run beside it, of one file; then one of its scripts goes, which is asked about.
  await submit(page, "films/second");
  await becomes(page, "done");
  await page.getByRole("link", { name: "All runs" }).click();
  for (const name of ["film", "films/second"]) await page.getByRole("link", { name, exact: true }).waitFor();
  await shot(page, "runs");
});

test("what the bucket has and the page has not is deleted only when that is said", async (t) => {
  const bucket = await dev(t);
  const text = "Screen 48 32\nSphere 4  8 8 -9  .2 .2 .2  .7 .6 .5\nTrace\n";
  const folder = mkdtempSync(join(tmpdir(), "rayfold-film-"));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  mkdirSync(join(folder, "film"));
  for (const name of ["1.txt", "other.txt"]) writeFileSync(join(folder, "film", name), text);
  const sent = spawnSync(program, ["submit", join(folder, "film"), "--bucket", "rayfold", "-o", join(folder, "a.gif")], {
    env: { ...process.env, ...bucket.exports },
  });
  assert.equal(sent.status, 0, String(sent.stderr));
  rmSync(join(folder, "film", "other.txt"));
  const { page, path } = await studio(t, bucket.exports, { from: join(folder, "film"), name: "film" });
  await (await output(page, "Submit")).click();
  await page.getByRole("button", { name: "Estimate the cost" }).click();
  const agree = page.getByLabel(/Delete a script of the bucket that the page does not have: scripts\/film\/other.txt/);
  await agree.waitFor();
  const go = page.getByRole("button", { name: "Submit", exact: true });
  assert.ok(await go.isDisabled(), "not before it is said");
  await agree.check();
  await go.click();
  await becomes(page, "done");
  await page.getByText("done: 1 of 1 frame").waitFor();
  assert.ok((await downloaded(page, /Download GIF/)).equals(rendered(path, folder)), basename(path));
});

test("without a bucket the page says how to name one", async (t) => {
  const { page, address, check } = await open(t, { from: join(scenes, "hello/frame01.txt"), env: { RAYFOLD_BUCKET: undefined } });
  await (await output(page, "Frame")).waitFor();
  assert.equal(await page.locator("#more-output").getByRole("link", { name: "Submit" }).count(), 0);
  await page.goto(`${address}#submit`);
  await page.getByText("No bucket was named").waitFor();
  check();
});
