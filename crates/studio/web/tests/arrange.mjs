// The start page and the tour, and what editors have: copies as text, alignment, boxes, search, curves, motion paths.

import assert from "node:assert/strict";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";

import { audit, drag, open, openStart, over, clickRow, shot, until } from "./stage.mjs";

const SCENE =
  "Screen 320 180\nLook 0 3 9  0 0.5 0  40\nIlight 1 1 1 1 -1 -1   # sun\nMaterial red diffuse 1 0 0\n" +
  "Sphere 0.4  -2 0.4 0  red   # left\nSphere 0.6  1.5 1.5 0  red   # right\nTrace\n";
const ANIMATED = SCENE.replace("Trace", "Sphere 0.3  (smooth 1:-1 10:1) 0.3 1  .1 .1 .1 .2 .4 .9   # runner\nFrames 10\nTrace");
const x = (text, name) => text.split("\n").find((line) => line.endsWith(`# ${name}`)).split(/\s+/)[2];

test("the start page opens copies of examples, an empty scene and recent scenes, and the tour can be left", async (t) => {
  const { page, folder, address } = await openStart(t);
  await until(() => page.locator("img").first().evaluate((image) => image.complete && image.naturalWidth > 0));
  await until(() => page.locator("img").nth(1).evaluate((image) => image.complete && image.naturalWidth > 0));
  assert.deepEqual(await audit(page), []);
  await shot(page, "start");
  await page.getByText("hello", { exact: true }).click();
  await page.locator("canvas[data-picture]").waitFor();
  assert.ok(existsSync(join(folder, "hello.txt")));
  await page.getByRole("link", { name: "Start page" }).click();
  await page.waitForURL(address);
  await page.getByText("hello.txt", { exact: true }).click();
  await page.locator("canvas[data-picture]").waitFor();
  await page.getByRole("link", { name: "Start page" }).click();
  await page.getByText("Empty scene").click();
  await page.locator("canvas[data-picture]").waitFor();
  assert.ok(existsSync(join(folder, "scene.txt")));
  await page.getByRole("button", { name: "Keys" }).click();
  await page.getByRole("button", { name: "Tour" }).click();
  const tour = page.getByRole("dialog", { name: "Tour" });
  for (let step = 1; step <= 5; step += 1) {
    await tour.getByText(`${step} of 5`).waitFor();
    await tour.getByRole("button", { name: step < 5 ? "Next" : "Done" }).click();
  }
  await tour.waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Keys" }).click();
  await page.getByRole("button", { name: "Tour" }).click();
  await page.keyboard.press("Escape");
  await tour.waitFor({ state: "detached" });
});

test("objects are pasted as text with what they name, and aligned", async (t) => {
  const studio = await open(t, { text: SCENE });
  const { page, context } = studio;
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  await clickRow(page, ".item", { hasText: "left" });
  await page.locator(".viewport").focus();
  await page.keyboard.press("Control+c");
  const copied = "Material red diffuse 1 0 0\nSphere 0.4  -2 0.4 0  red   # left\n";
  await until(async () => (await page.evaluate(() => navigator.clipboard.readText())) === copied);
  await page.keyboard.press("Control+v");
  await until(async () => (await studio.saved()).match(/# left/g).length === 2);
  assert.equal((await studio.saved()).match(/^Material/gm).length, 1);
  await page.keyboard.press("Control+z");
  await until(async () => (await studio.saved()) === SCENE);
  await clickRow(page, ".item", { hasText: "left" });
  await clickRow(page, ".item", { hasText: "right", modifiers: ["Control"] });
  await page.getByLabel("Align").selectOption("0 middle");
  await until(async () => x(await studio.saved(), "left") === x(await studio.saved(), "right"));
  studio.check();
});

test("a box selects what is in it, and the axes turn the view", async (t) => {
  const studio = await open(t, { text: SCENE });
  const { page } = studio;
  await studio.settled();
  await page.keyboard.down("Control");
  await page.keyboard.down("Shift");
  await drag(page, await over(page, 0.02, 0.02), await over(page, 0.98, 0.98));
  await page.keyboard.up("Shift");
  await page.keyboard.up("Control");
  await until(async () => (await page.locator(".item[aria-selected=true]").count()) === 2);
  assert.equal(readFileSync(studio.path, "utf8"), SCENE);
  // The ends of the axes with letters come last.
  await page.locator(".cube .axis-y circle").last().click();
  await until(async () => (await page.getByRole("button", { name: "Camera", exact: true }).getAttribute("aria-pressed")) === "false");
  // The larger ball is on the right, and on the left from behind.
  const red = () => page.locator("canvas").evaluate((canvas) => {
    const { data, width } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let [sum, count] = [0, 0];
    for (let at = 0; at < data.length; at += 4) {
      if (data[at] > 60 && data[at] > 3 * data[at + 1]) [sum, count] = [sum + ((at / 4) % width) / width, count + 1];
    }
    return count > 0 ? sum / count : NaN;
  });
  await page.locator(".cube .axis-z circle").last().click();
  await studio.settled();
  const before = await red();
  // A click on an axis that is looked along turns to the other side.
  await page.locator(".cube .axis-z circle").last().click();
  await studio.settled();
  assert.ok(before > 0.55 && (await red()) < 0.45, `${before} ${await red()}`);
  studio.check();
});

test("the search runs actions, adds and selects", async (t) => {
  const studio = await open(t, { text: SCENE });
  const { page } = studio;
  const search = async (text) => {
    await page.locator(".viewport").focus();
    await page.keyboard.press("Control+k");
    await page.getByRole("combobox", { name: "Search" }).fill(text);
  };
  await search("right");
  await page.locator(".search .item", { hasText: "right" }).first().waitFor();
  assert.deepEqual(await audit(page), []);
  await shot(page, "search");
  await page.locator(".search .item", { hasText: /^rightSphere/ }).click();
  await page.locator(".item[aria-selected=true]", { hasText: "right" }).waitFor();
  await search("dupl");
  await page.keyboard.press("Enter");
  await until(async () => (await studio.saved()).includes("right copy"));
  await search("add torus");
  await page.keyboard.press("Enter");
  await until(async () => (await studio.saved()).includes("Torus"));
  studio.check();
});

test("a key is dragged as a point of a curve, and as a point of the motion path", async (t) => {
  const studio = await open(t, { text: ANIMATED });
  const { page } = studio;
  await clickRow(page, ".item", { hasText: "runner" });
  await page.getByRole("button", { name: "Curves" }).click();
  const key = page.locator(".curves .key").last();
  const at = await key.boundingBox();
  await shot(page, "curves");
  await drag(page, [at.x + 12, at.y + 12], [at.x + 12, at.y + 60]);
  const last = async () => /smooth 1:-1 (\d+):([-.\d]+)\)/.exec(await studio.saved())?.slice(1).map(Number);
  await until(async () => (await last())?.[1] < 1);
  assert.equal((await last())[0], 10, "the frame stays");
  const value = (await last())[1];
  await studio.settled();
  const dot = await page.locator("[data-grip=key] .dot").last().boundingBox();
  await drag(page, [dot.x + 5, dot.y + 5], [dot.x + 65, dot.y + 5]);
  await until(async () => Math.abs((await last())?.[1] - value) > 0.1);
  assert.equal((await last())[0], 10);
  assert.deepEqual(await audit(page), []);
  studio.check();
});

test("every easing of the language is chosen, and the tangents of a bezier are dragged in one step each", async (t) => {
  const studio = await open(t, { text: ANIMATED });
  const { page } = studio;
  await clickRow(page, ".item", { hasText: "runner" });
  await page.getByRole("button", { name: "Curves" }).click();
  await page.locator(".curves .key").first().click();
  const easing = page.getByLabel("Easing");
  const curve = async () => /\((.*?) 1:-1 10:/.exec(await studio.saved())?.[1];
  const names = await easing.locator("option").allTextContents();
  assert.deepEqual(names, ["linear", "smooth", "step", "in", "out", "inout", "back", "elastic", "bounce", "bezier"]);
  for (const name of names.slice(1)) {
    await easing.selectOption({ label: name });
    await until(async () => (await curve())?.split(" ")[0] === name);
    await until(async () => (await page.locator(".tangent").count()) === (name === "bezier" ? 2 : 0));
    await shot(page, `curves-${name}`);
  }
  assert.equal(await curve(), "bezier 0.25 0.1 0.25 1");
  const [from, to] = await page.locator(".curves .key:not(.tangent)").evaluateAll((all) => all.map((one) => one.getBoundingClientRect()).map(({ x, y }) => [x + 12, y + 12]));
  // To the middle in time, and three quarters of the way.
  const at = ([x, y]) => [from[0] + x * (to[0] - from[0]), from[1] + y * (to[1] - from[1])];
  await drag(page, at([0.25, 0.1]), at([0.5, 0.75]));
  const numbers = async () => (await curve())?.split(" ").slice(1).map(Number);
  const near = (found, expected) => found?.length === 4 && found.every((number, at) => Math.abs(number - expected[at]) < 0.03);
  await until(async () => near(await numbers(), [0.5, 0.75, 0.25, 1]));
  await drag(page, at([0.25, 1]), at([-0.4, 1]));
  await until(async () => near(await numbers(), [0.5, 0.75, 0, 1]));
  await page.keyboard.press("Control+z");
  await until(async () => near(await numbers(), [0.5, 0.75, 0.25, 1]));
  await page.locator(".tangent").nth(1).focus();
  await page.keyboard.press("Alt+ArrowDown");
  await until(async () => near(await numbers(), [0.5, 0.75, 0.25, 0.97]));
  await page.getByRole("button", { name: "Repeat", exact: true }).click();
  await until(async () => /bezier .* cycle 1:-1/.test(await studio.saved()));
  assert.ok(near((await numbers()).slice(0, 4), [0.5, 0.75, 0.25, 0.97]), "a cycle keeps its tangents");
  assert.deepEqual(await audit(page), []);
  studio.check();
});

test("keys of the curves are at the frames of their tracks, stay held outside of the lane, and a zoom is for its tracks", async (t) => {
  const text = ANIMATED.replace("0.3 1  .1 .1 .1 .2 .4 .9", "(1:2 9:4) 1  .1 .1 .1 .2 .4 .9").replace("(smooth 1:-1", "(smooth -3:5 1:-1");
  const studio = await open(t, { text });
  const { page } = studio;
  await page.locator(".tracks .label").first().click();
  await page.getByRole("button", { name: "Curves" }).click();
  const lefts = (selector) => page.locator(selector).evaluateAll((all) => all.map((one) => Math.round(one.getBoundingClientRect().left)));
  await page.locator(".curves .key").nth(1).waitFor();
  assert.deepEqual(await lefts(".curves .key"), await lefts("[data-row='0']"), "also without the key before the first frame");
  const lane = await page.locator(".curves .lane").boundingBox();
  const key = await page.locator(".curves .key").last().boundingBox();
  await page.mouse.move(key.x + 12, key.y + 12);
  await page.mouse.down();
  await page.mouse.move(key.x + 12, lane.y - 60, { steps: 5 });
  await until(async () => / 10:[2-9]/.test(await studio.saved()));
  await page.mouse.move(key.x + 12, lane.y + 70, { steps: 5 });
  await page.mouse.up();
  await until(async () => !/ 10:[2-9]/.test(await studio.saved()));
  await page.mouse.move(lane.x + 50, lane.y + 70);
  for (let times = 0; times < 6; times += 1) await page.mouse.wheel(0, -400);
  await until(async () => (await page.locator(".curves .key").count()) === 0);
  await page.locator(".tracks .label").nth(1).click();
  await until(async () => (await page.locator(".curves .key").count()) === 2);
  // With Shift the wheel moves the values.
  const first = page.locator(".curves .key").first();
  const before = await first.boundingBox();
  await page.mouse.move(lane.x + 50, lane.y + 70);
  await page.keyboard.down("Shift");
  await page.mouse.wheel(0, 20);
  await page.keyboard.up("Shift");
  await until(async () => Math.abs((await first.boundingBox()).y - before.y + 20) < 2);
  await shot(page, "curves-two");
  studio.check();
});

test("the sun turns by its angles", async (t) => {
  const studio = await open(t, { text: SCENE });
  const { page } = studio;
  await clickRow(page, ".item", { hasText: "sun" });
  const height = page.getByRole("spinbutton", { name: "sun height" });
  await height.fill("90");
  await height.press("Enter");
  await until(async () => /Ilight 1 1 1 (-?0) -1 (-?0)/.test(await studio.saved()));
  studio.check();
});

test("a number and a colour are set in all that are selected, as one step", async (t) => {
  const text =
    "Screen 320 180\nLook 0 3 9  0 0.5 0  40\nIlight 1 1 1 1 -1 -1\nMaterial gold diffuse .5 .4 .1\n" +
    "Sphere 1  -2 1 0  .1 .1 .1  .8 .2 .2   # one\nSphere 2  0 1 0  #202020  .2 .8 .2   # two\nSphere .5  2 1 0  gold   # three, not gold\n" +
    "Box 0 0 -3  1 1 -2  .1 .1 .1  .2 .2 .8   # box\nTrace\n";
  const studio = await open(t, { text });
  const { page } = studio;
  const line = async (name) => (await studio.saved()).split("\n").find((line) => line.includes(`# ${name}`));
  await page.locator(".item", { hasText: "box" }).click();
  for (const name of ["one", "two", "three"]) await page.locator(".item", { hasText: name }).click({ modifiers: ["Control"] });
  await page.locator(".item", { hasText: "one" }).click({ modifiers: ["Control"] });
  await page.locator(".item", { hasText: "one" }).click({ modifiers: ["Control"] });
  await studio.settled();
  const radius = page.getByRole("spinbutton", { name: "radius" });
  await radius.fill("1.5");
  await radius.press("Enter");
  await until(async () => /^Sphere 1\.5 /.test(await line("three")));
  assert.equal(await line("one"), "Sphere 1.5  -2 1 0  .1 .1 .1  .8 .2 .2   # one");
  assert.equal(await line("two"), "Sphere 1.5  0 1 0  #202020  .2 .8 .2   # two");
  assert.equal(await line("three"), "Sphere 1.5  2 1 0  gold   # three, not gold");
  assert.match(await line("box"), /^Box 0 0 -3 {2}1 1 -2 /);
  await page.getByLabel("colour, as a colour", { exact: true }).fill("#0000ff");
  await until(async () => /0 0 1 /.test(await line("box")));
  assert.equal(await line("one"), "Sphere 1.5  -2 1 0  .1 .1 .1  0 0 1   # one");
  assert.equal(await line("two"), "Sphere 1.5  0 1 0  #202020  0 0 1   # two");
  assert.equal(await line("three"), "Sphere 1.5  2 1 0  gold   # three, not gold", "a material stays");
  assert.equal(await line("box"), "Box 0 0 -3  1 1 -2  .1 .1 .1  0 0 1   # box");
  await page.locator(".viewport").focus();
  await page.keyboard.press("Control+z");
  await until(async () => (await line("box")).includes(".2 .2 .8"));
  assert.match(await line("one"), /\.8 \.2 \.2/);
  await page.keyboard.press("Control+z");
  await until(async () => (await studio.saved()) === text);
  studio.check();
});

test("the focus stays in its panel when what has it is gone or drawn anew", async (t) => {
  const studio = await open(t, { text: SCENE });
  const { page } = studio;
  const focused = () => page.evaluate(() => [document.activeElement.tagName, document.activeElement.ariaLabel, document.activeElement.closest(".panel")?.className]);
  // A list whose row was renamed goes on by its keys.
  await page.locator(".item", { hasText: "left" }).click();
  await page.getByRole("listbox").focus();
  await page.keyboard.press("F2");
  await page.keyboard.type("first");
  await page.keyboard.press("Enter");
  await page.locator(".item", { hasText: "first" }).waitFor();
  await page.keyboard.press("ArrowDown");
  await page.locator(".item[aria-selected=true]", { hasText: "right" }).waitFor();
  // A field is the same field of the next object that is selected, and of the line that was moved.
  const radius = page.getByRole("spinbutton", { name: "radius" });
  await radius.focus();
  await page.locator(".item", { hasText: "first" }).evaluate((row) => row.click());
  await until(async () => (await radius.inputValue()) === "0.4");
  assert.equal((await focused())[1], "radius");
  await radius.press("Tab");
  const before = await focused();
  assert.notEqual(before[0], "BODY");
  // The button of what is removed is gone with it.
  await page.getByRole("button", { name: "Delete", exact: true }).focus();
  await page.keyboard.press("Enter");
  await page.getByText("Scene settings").waitFor();
  assert.match((await focused())[2], /inspector/);
  studio.check();
});

test("the list of keys has all keys, in columns where there is room", async (t) => {
  const studio = await open(t, { text: SCENE });
  const { page } = studio;
  await page.locator(".viewport").focus();
  await page.keyboard.press("?");
  const dialog = page.getByRole("dialog", { name: "Keys" });
  const keys = await dialog.locator("kbd").allTextContents();
  const own = readFileSync(join(import.meta.dirname, "../src/script/editor.ts"), "utf8");
  const named = [...own.matchAll(/key: "((?:Mod|Alt|Shift)-[^"]+)", run: (?!cm.deleteGroup|cm.selectAll)/g)].map(([, key]) => key);
  assert.ok(named.length > 10, "keys of the script");
  const people = (key) =>
    key.replace("Shift-Alt", "Alt-Shift").replace("Mod", "Ctrl").replace("ArrowUp", "↑").replace("ArrowDown", "↓").replaceAll("-", "+").replace(/\+([a-z])$/, (_, letter) => `+${letter.toUpperCase()}`);
  for (const key of [...named.map(people), "F8", "F3", "Ctrl+F", "Ctrl+Space", "F2", "Alt+←", "Alt+↑", "Ctrl+Enter", "Shift+↑", "Home", "+", "-", "?"]) {
    assert.ok(keys.includes(key), `${key} in the list`);
  }
  assert.equal(await dialog.locator("td:empty").count(), 0, "each row has a key");
  const lefts = () => dialog.locator("caption").evaluateAll((all) => new Set(all.map((one) => Math.round(one.getBoundingClientRect().left))).size);
  assert.ok((await lefts()) > 1, "columns");
  await page.setViewportSize({ width: 390, height: 844 });
  assert.equal(await lefts(), 1);
  assert.ok(await dialog.evaluate((of) => of.scrollWidth <= of.clientWidth), "nothing is beside it");
  await page.setViewportSize({ width: 1400, height: 900 });
  await shot(page, "keys");
  assert.deepEqual(await audit(page), []);
  studio.check();
});

test("Delete and Ctrl+C are for the object in the picture, and for the keys in the timeline", async (t) => {
  const studio = await open(t, { text: ANIMATED });
  const { page, context } = studio;
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  const has = async (part) => (await studio.saved()).includes(part);
  await page.locator(".tracks .label").first().click();
  assert.equal(await page.locator(".item[aria-selected=true]", { hasText: "runner" }).count(), 1, "its object is selected, too");
  await page.locator(".viewport").focus();
  await page.keyboard.press("Control+c");
  await until(async () => (await page.evaluate(() => navigator.clipboard.readText())).startsWith("Sphere 0.3"));
  await page.keyboard.press("Delete");
  await until(async () => !(await has("# runner")));
  await page.keyboard.press("Control+z");
  await until(() => has("(smooth 1:-1 10:1)"));
  await page.locator(".tracks .label").first().click();
  await page.keyboard.press("Delete");
  await until(async () => (await has("# runner")) && !(await has("smooth")));
  studio.check();
});

test("the search finds outputs, scripts, starter materials, objects without a name, and the dialogs", async (t) => {
  const folder = join(mkdtempSync(join(tmpdir(), "rayfold-search-")), "film");
  mkdirSync(folder);
  t.after(() => rmSync(join(folder, ".."), { recursive: true, force: true }));
  writeFileSync(join(folder, "one.txt"), SCENE.replace("   # left", ""));
  writeFileSync(join(folder, "two.txt"), SCENE);
  const studio = await open(t, { from: folder, name: "film" });
  const { page } = studio;
  const search = async (text) => {
    await page.locator(".viewport").focus();
    await page.keyboard.press("Control+k");
    await page.getByRole("combobox", { name: "Search" }).fill(text);
  };
  await search("sphere line 5");
  await page.keyboard.press("Enter");
  await page.locator(".item[aria-selected=true]", { hasText: "Sphere in line 5" }).waitFor();
  await search("starter chalk");
  await page.keyboard.press("Enter");
  await until(() => readFileSync(join(studio.path, "one.txt"), "utf8").includes("Material chalk"));
  await search("two.txt");
  await page.keyboard.press("Enter");
  await page.locator(".scene.shown", { hasText: "two.txt" }).waitFor();
  await search("render webp");
  await page.keyboard.press("Enter");
  await page.getByRole("link", { name: /Download WebP/ }).waitFor();
  for (const [text, name] of [["apng output", "Render APNG"], ["frames output", "Frames"], ["scripts output", "Scripts"], ["save under another", "File"], ["dark", "Light or dark"]]) {
    await search(text);
    await page.locator(".search .item").filter({ has: page.getByText(name, { exact: true }) }).waitFor();
    await page.keyboard.press("Escape");
  }
  studio.check();
});
