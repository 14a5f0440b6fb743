// Journeys in Firefox, driven by WebDriver BiDi. `FIREFOX` names the browser.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { copyFileSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import puppeteer from "puppeteer-core";

import { start } from "./processes.mjs";

const program = process.env.RAYFOLD;
const scenes = join(import.meta.dirname, "../../../../scenes");

let browser;
before(async () => {
  browser = await puppeteer.launch({ browser: "firefox", executablePath: process.env.FIREFOX, headless: true });
});
after(() => browser?.close());

/** A page of a server of its own, with a copy of an example. */
async function open(t) {
  const folder = mkdtempSync(join(tmpdir(), "rayfold-firefox-"));
  const path = join(folder, "scene.txt");
  copyFileSync(join(scenes, "hello/frame01.txt"), path);
  const { server, ended, said } = start(program, ["studio", path, "--no-open"], { XDG_STATE_HOME: folder });
  const address = (await said((text) => text.includes("\n"))).trim();
  const page = await browser.newPage();
  await page.setViewport({ width: 1400, height: 900 });
  const faults = [];
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  t.after(async () => {
    await page.close();
    server.kill("SIGINT");
    await ended;
    rmSync(folder, { recursive: true, force: true });
  });
  await page.goto(address);
  await page.waitForSelector("canvas[data-final=true]", { timeout: 60_000 });
  return { page, path, folder, faults };
}

async function until(condition) {
  const end = Date.now() + 60_000;
  while (!(await condition())) {
    assert.ok(Date.now() < end, `waited in vain for ${condition}`);
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

test("in Firefox an object is dragged, and undo brings back every byte", async (t) => {
  const { page, path, faults } = await open(t);
  const before = readFileSync(path, "utf8");
  const box = await (await page.$("canvas")).boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.6, box.y + box.height / 2, { steps: 12 });
  await page.mouse.up();
  await until(() => readFileSync(path, "utf8") !== before);
  await page.keyboard.down("Control");
  await page.keyboard.press("z");
  await page.keyboard.up("Control");
  await until(() => readFileSync(path, "utf8") === before);
  // The same across a field for a number, and a click goes into it.
  const field = await page.waitForSelector(".inspector .field:not(.colour) .slides");
  const room = await field.boundingBox();
  const middle = [room.x + room.width / 2, room.y + room.height / 2];
  await page.mouse.move(...middle);
  await page.mouse.down();
  await page.mouse.move(middle[0] + 30, middle[1], { steps: 6 });
  await page.mouse.up();
  await until(() => readFileSync(path, "utf8") !== before);
  assert.equal(await field.evaluate((field) => field === document.activeElement), false);
  await page.keyboard.down("Control");
  await page.keyboard.press("z");
  await page.keyboard.up("Control");
  await until(() => readFileSync(path, "utf8") === before);
  await page.mouse.click(...middle);
  await page.keyboard.type("0.123");
  await page.keyboard.press("Enter");
  await until(() => readFileSync(path, "utf8").includes(" 0.123 "));
  assert.deepEqual(faults, []);
});

test("in Firefox what is typed is the text of the file", async (t) => {
  const { page, path, faults } = await open(t);
  const before = readFileSync(path, "utf8");
  await (await page.waitForSelector(">>> .cm-content")).focus();
  await page.keyboard.down("Control");
  await page.keyboard.press("End");
  await page.keyboard.up("Control");
  const typed = "# typed in Firefox, letter by letter";
  await page.keyboard.type(typed);
  await until(() => readFileSync(path, "utf8") === before + typed);
  assert.deepEqual(faults, []);
});

test("in Firefox the GIF has the bytes of the command", async (t) => {
  const { page, path, folder, faults } = await open(t);
  await page.click("::-p-aria(Render GIF)");
  await page.waitForSelector(".result a.button", { timeout: 60_000 });
  const bytes = await page.evaluate(async () => {
    const file = new Uint8Array(await (await fetch("animation")).arrayBuffer());
    let text = "";
    for (const byte of file) text += String.fromCharCode(byte);
    return btoa(text);
  });
  const expected = join(folder, "expected.gif");
  const run = spawnSync(program, ["render", path, "-o", expected]);
  assert.equal(run.status, 0, String(run.stderr));
  assert.ok(Buffer.from(bytes, "base64").equals(readFileSync(expected)), "the same bytes");
  assert.deepEqual(faults, []);
});
