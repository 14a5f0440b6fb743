// What the page's tests share: a browser, and pages of servers of their own. Whatever is started here is ended here.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before } from "node:test";

import { chromium } from "playwright-core";

import { start } from "./processes.mjs";

export const program = process.env.RAYFOLD;
export const scenes = join(import.meta.dirname, "../../../../scenes");
const shots = process.env.SHOTS;

let browser;
before(async () => {
  browser = await chromium.launch({ executablePath: process.env.CHROMIUM, args: ["--no-sandbox"] });
});
after(() => browser?.close());

/** A page of a server that serves a copy of `from`, or a new script with `text`. */
export async function open(t, { from, text, name = "scene.txt", scheme = "light", size = [1400, 900], blank = text === "", args = [], env = {} }) {
  const folder = mkdtempSync(join(tmpdir(), "rayfold-studio-"));
  const path = join(folder, name);
  if (from) cpSync(from, path, { recursive: true });
  if (text !== undefined) writeFileSync(path, text);
  // What is opened here is not among the user's recent scenes.
  const memory = mkdtempSync(join(tmpdir(), "rayfold-state-"));
  const { server, ended, said } = start(program, ["studio", path, "--no-open", ...args], { XDG_STATE_HOME: memory, ...env });
  const address = (await said((text) => text.includes("\n"))).trim();
  const context = await browser.newContext({ viewport: { width: size[0], height: size[1] }, colorScheme: scheme });
  const page = await context.newPage();
  const faults = [];
  const outside = [];
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  page.on("request", (sent) => {
    if (!sent.url().startsWith(address) && !/^(data|blob):/.test(sent.url())) outside.push(sent.url());
  });
  t.after(async () => {
    await context.close();
    server.kill("SIGINT");
    await ended;
    for (const used of [folder, memory]) rmSync(used, { recursive: true, force: true });
  });
  await page.goto(address);
  const drawn = () => page.locator("canvas").getAttribute("data-picture");
  if (!blank) await until(async () => (await drawn()) !== null);
  /** Waits until the picture that was ordered last is on the canvas, as it will stay. */
  const settled = async () => {
    let last = "";
    await until(async () => {
      const now = await page.locator("canvas").evaluate(({ dataset }) => `${dataset.picture} ${dataset.wanted} ${dataset.final}`);
      const same = now === last && /^(\d+) \1 true$/.test(now);
      last = now;
      await page.waitForTimeout(150);
      return same;
    });
  };
  const saved = async () => {
    await page.waitForTimeout(300);
    await page.getByText("saved", { exact: true }).waitFor({ timeout: 60_000 });
    return readFileSync(path, "utf8");
  };
  const check = () => {
    assert.deepEqual(faults, [], "errors of the page");
    assert.deepEqual(outside, [], "nothing but its own server");
  };
  return { page, context, path, folder, address, settled, saved, check, ended, server };
}

/** The start page of a program of its own, with its folder. */
export async function openStart(t, size = [1024, 768], scheme = "light") {
  const folder = mkdtempSync(join(tmpdir(), "rayfold-studio-"));
  const { server, ended, said } = start(program, ["studio", "--no-open"], { XDG_STATE_HOME: folder }, folder);
  const address = (await said((text) => text.includes("\n"))).trim();
  const context = await browser.newContext({ viewport: { width: size[0], height: size[1] }, colorScheme: scheme });
  const page = await context.newPage();
  t.after(async () => {
    await context.close();
    server.kill("SIGINT");
    await ended;
    rmSync(folder, { recursive: true, force: true });
  });
  await page.goto(address);
  return { page, folder, address };
}

/** Waits for a condition; its patience, in milliseconds, is longer than anything takes on a loaded machine. */
export async function until(condition, patience = 60_000) {
  const end = Date.now() + patience;
  while (!(await condition())) {
    assert.ok(Date.now() < end, `waited in vain for ${condition}`);
    await new Promise((resolve) => setTimeout(resolve, 40));
  }
}

/** Whether the canvas shows what the command line draws of a script, level by level. */
export async function isDrawn(page, path, frame = 1) {
  const size = await page.locator("canvas").evaluate((canvas) => `${canvas.width}x${canvas.height}`);
  const out = `${path}.${frame}.png`;
  const run = spawnSync(program, ["render", path, "-o", out, "--size", size, "--frame", String(frame)]);
  assert.equal(run.status, 0, String(run.stderr));
  const png = readFileSync(out).toString("base64");
  rmSync(out);
  const differ = await page.locator("canvas").evaluate(async (shown, png) => {
    const image = new Image();
    image.src = `data:image/png;base64,${png}`;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    canvas.getContext("2d").drawImage(image, 0, 0);
    const levels = (of) => of.getContext("2d").getImageData(0, 0, image.width, image.height).data;
    const [a, b] = [levels(shown), levels(canvas)];
    return a.reduce((differ, level, at) => differ + (level === b[at] ? 0 : 1), 0);
  }, png);
  assert.equal(differ, 0, `levels that differ, of ${size}`);
}

/** A point of the window over a point of the picture, given by shares of its sides. */
export async function over(page, x, y) {
  const box = await page.locator("canvas").boundingBox();
  return [box.x + x * box.width, box.y + y * box.height];
}

/** Clicks on a row of the outliner. Only rows in sight are made, and the list may change while one is looked for. */
export async function clickRow(page, selector, { modifiers, ...options } = {}) {
  const found = page.locator(selector, options).first();
  const list = page.getByRole("listbox");
  let top = 0;
  await until(async () => {
    if ((await found.count()) > 0) return found.click({ modifiers, timeout: 2000 }).then(() => true, () => false);
    const end = await list.evaluate((list, top) => ((list.scrollTop = top), list.scrollHeight), top);
    top = top < end ? top + 100 : 0;
    return false;
  });
}

/** Opens the menu of outputs and returns one of its links. */
export async function output(page, name) {
  await page.getByRole("button", { name: "More output" }).click();
  return page.locator("#more-output").getByRole("link", { name, exact: true });
}

/** Puts the caret to the start of a line of the script, counted from 1. */
export async function goLine(page, number) {
  await page.locator(".cm-content").focus();
  await page.keyboard.press("Control+g");
  await page.keyboard.type(String(number));
  await page.keyboard.press("Enter");
  await until(() => page.locator(".code").evaluate((host) => host.shadowRoot.activeElement?.classList.contains("cm-content")));
}

/** Selects the line of the caret, also if it is shown in several rows. */
export async function selectLine(page) {
  await page.keyboard.press("Shift+End");
  await page.keyboard.press("Shift+End");
}

/** Replaces a line of the script, counted from 1, in the editor. */
export async function setLine(page, number, text) {
  await goLine(page, number);
  await selectLine(page);
  await page.keyboard.insertText(text);
}

/** The lines of the script that the editor has made: those in sight. */
export const seenLines = (page) => page.locator(".cm-line").allTextContents();

/** The line with the caret, and the column of the caret. */
export const caret = (page) =>
  page.locator(".code").evaluate((host) => {
    const { anchorNode: node, anchorOffset } = host.shadowRoot.getSelection?.() ?? getSelection();
    const line = (node instanceof Element ? node : node?.parentElement)?.closest(".cm-line");
    if (!line) return { text: "", column: -1 };
    const before = new Range();
    before.setStart(line, 0);
    before.setEnd(node, anchorOffset);
    return { text: line.textContent, column: before.toString().length };
  });

/** A source of numbers below a limit. It prints its seed: the test's own one, or `RAYFOLD_SEED`. */
export function random(t, own) {
  const seed = Number(process.env.RAYFOLD_SEED ?? own) >>> 0;
  t.diagnostic(`RAYFOLD_SEED=${seed}`);
  // The generator is mulberry32.
  let state = seed;
  return (limit) => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return Math.floor((((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32) * limit);
  };
}

/** About half of the cases, drawn anew by each run, for a test that takes long; `RAYFOLD_TESTS=all` takes all. */
export function half(t, cases) {
  if (process.env.RAYFOLD_TESTS === "all") return cases;
  const below = random(t, Date.now());
  return cases.filter(() => below(2) === 0);
}

export async function drag(page, from, to, steps = 8) {
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move(...to, { steps });
  await page.mouse.up();
}

export async function shot(page, name) {
  if (shots) await page.screenshot({ path: join(shots, `studio-${name}.png`) });
}

/** What axe finds wrong with a page, in light and in dark colours; it is left in those that it was in. */
export async function audit(page) {
  await page.evaluate(readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8"));
  const was = await page.evaluate(() => (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
  const wrong = [];
  for (const colorScheme of [was === "dark" ? "light" : "dark", was]) {
    await page.emulateMedia({ colorScheme });
    const found = await page.evaluate(() => window.axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"] }));
    for (const { id, nodes } of found.violations) wrong.push(`${colorScheme}: ${id}: ${nodes.map((n) => n.html).slice(0, 3).join(" | ")}`);
  }
  return wrong;
}
