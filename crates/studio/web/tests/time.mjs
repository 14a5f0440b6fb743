// Drives the timeline, groups, locks and materials in a real browser (`stage.mjs`).

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";

import { audit, drag, isDrawn, open, over, program, scenes, shot, until } from "./stage.mjs";

const TEXT = `# two balls
Screen 320 180
Look  0 2.5 9   0 0.8 0   38
Background 0.8 0.85 0.9
Ilight 0.9 0.9 0.85   0.5 -1 -0.6   # sun
Box -5 -0.2 -4  5 0 4   0.1 0.1 0.1   0.5 0.5 0.5   # floor
Sphere 0.8   (1:-2.50 26:2 50:-2.5) 0.8 0   0.1 0.02 0.02   0.85 0.2 0.15   # red
Sphere 0.5   0 0.5 2   0.02 0.05 0.1   0.15 0.4 0.8   # blue
Frames 50
Trace
`;
const MATERIALS = TEXT.replace(
  "Box -5",
  "Material glow ambient 0.2 0.1 (1:0 50:0.5) diffuse 0.6 0.5 0.2\nGroup pair\nSphere 0.3 0 0.3 0 glow\nEnd\nUse pair 2 0 0 0 (1:0 50:90) 0\nBox -5",
);
const line = (text, name) => text.split("\n").find((line) => line.endsWith(`# ${name}`));
const middle = (box) => [box.x + box.width / 2, box.y + box.height / 2];
const number = (page) => page.locator("output");

async function scrub(page, frame) {
  await page.getByRole("slider", { name: "Frame", exact: true }).fill(String(frame));
  await page.locator("output", { hasText: `frame ${frame} of` }).waitFor();
}

/** Where a key of the timeline is in the window. */
const keyAt = async (page, frame, label = "") =>
  middle(await page.getByRole("button", { name: new RegExp(`^Key of .*${label}.* at frame ${frame}:`) }).first().boundingBox());

/** Touches in place of the mouse. */
async function touch(studio, from, to) {
  const cdp = await studio.context.newCDPSession(studio.page);
  await cdp.send("Emulation.setTouchEmulationEnabled", { enabled: true });
  const at = ([x, y]) => [{ x, y }];
  await cdp.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: at(from) });
  for (let step = 1; step <= 6; step += 1) {
    const share = step / 6;
    const on = [from[0] + (to[0] - from[0]) * share, from[1] + (to[1] - from[1]) * share];
    await cdp.send("Input.dispatchTouchEvent", { type: "touchMove", touchPoints: at(on) });
  }
  await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
}

test("five objects from an empty page, two of them animated, without a number; the GIF is that of the command line", async (t) => {
  const studio = await open(t, { text: "", name: "mine.txt" });
  const { page } = studio;
  const add = page.locator(".palette");
  await add.getByRole("button", { name: "Box", exact: true }).click();
  await studio.settled();
  const target = page.locator(".viewport");
  const box = await target.boundingBox();
  for (const [name, x, y] of [["Sphere", 0.3, 0.62], ["Cone", 0.7, 0.62], ["Torus", 0.2, 0.45], ["Sphere", 0.8, 0.8]]) {
    await add.getByRole("button", { name, exact: true }).dragTo(target, { targetPosition: { x: x * box.width, y: y * box.height } });
    await studio.settled();
  }
  assert.equal(await page.locator(".item.object").count(), 5);
  await page.getByRole("button", { name: "Animate" }).click();
  await page.getByRole("button", { name: "Auto-key", pressed: true }).waitFor();
  await scrub(page, 30);
  for (const [row, way] of [[1, [120, 0]], [2, [-140, 0]]]) {
    await page.locator(".item.object").nth(row).click();
    await studio.settled();
    const at = middle(await page.locator("[data-grip=axis-x] .reach").boundingBox());
    await drag(page, at, [at[0] + way[0], at[1] + way[1]]);
  }
  await page.getByRole("button", { name: /^Key of/ }).nth(3).waitFor();
  await page.getByRole("button", { name: "Onion skin" }).click();
  await scrub(page, 16);
  await page.locator(".ghost").first().waitFor();
  await studio.settled();
  await shot(page, "animated");
  const text = await studio.saved();
  assert.equal((text.match(/\(smooth 1:[-\d.]+ 30:[-\d.]+\)/g) ?? []).length, 3, "a cone has two ends: " + text);
  assert.equal(text.split("\n").filter((line) => /^(Box|Sphere|Cone|Torus) /.test(line)).length, 5, text);
  await isDrawn(page, studio.path, 16);
  for (const format of ["GIF", "APNG", "WebP"]) {
    if (format !== "GIF") await page.getByRole("button", { name: "More output" }).click();
    await page.getByRole("button", { name: `Render ${format}` }).click();
    const [download] = await Promise.all([
      page.waitForEvent("download", { timeout: 120_000 }),
      page.getByRole("link", { name: `Download ${format}` }).click({ timeout: 120_000 }),
    ]);
    const expected = join(studio.folder, `expected.${format.toLowerCase()}`);
    const run = spawnSync(program, ["render", studio.path, "-o", expected]);
    assert.equal(run.status, 0, String(run.stderr));
    assert.ok(readFileSync(await download.path()).equals(readFileSync(expected)), `the same bytes of ${format}`);
  }
  studio.check();
});

test("keys are dragged, by touch too, copied, eased, repeated and deleted, and all else in the script stays", async (t) => {
  const studio = await open(t, { text: TEXT });
  const { page, context } = studio;
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  await page.locator(".item", { hasText: "red" }).click();
  await page.locator(".way").waitFor({ state: "attached" });
  const lane = await page.locator(".track .lane").nth(1).boundingBox();
  const frame = lane.width / 50;
  const red = async (expected) => {
    const text = TEXT.replace("(1:-2.50 26:2 50:-2.5)", expected);
    await until(async () => (await studio.saved()) === text);
  };
  const [x, y] = await keyAt(page, 26);
  await drag(page, [x, y], [x + 4 * frame, y]);
  await red("(1:-2.5 30:2 50:-2.5)");
  await page.keyboard.press("Control+z");
  await red("(1:-2.50 26:2 50:-2.5)");
  await touch(studio, [x, y], [x - 6 * frame, y]);
  await red("(1:-2.5 20:2 50:-2.5)");
  await scrub(page, 35);
  await page.getByRole("button", { name: "Copy keys" }).click();
  await page.getByRole("button", { name: "Paste 1" }).click();
  await red("(1:-2.5 20:2 35:2 50:-2.5)");
  // The clipboard has them as text, which is pasted in another window as well.
  await page.keyboard.press("Control+z");
  await red("(1:-2.5 20:2 50:-2.5)");
  const copied = await page.evaluate(() => navigator.clipboard.readText());
  assert.match(copied, /^Sphere cx \(20:2\) {3}# number 2 of line \d+\n$/);
  const other = await open(t, { text: TEXT.replace(/^Sphere/m, "# one line more\nSphere") });
  await scrub(other.page, 35);
  await other.page.locator(".item", { hasText: "red" }).click();
  await other.page.locator(".viewport").focus();
  await other.page.evaluate((text) => {
    const data = new DataTransfer();
    data.setData("text/plain", text);
    document.activeElement.dispatchEvent(new ClipboardEvent("paste", { clipboardData: data, bubbles: true }));
  }, copied);
  await until(async () => (await other.saved()).includes("(1:-2.5 26:2 35:2 50:-2.5)"));
  other.check();
  await page.locator(".viewport").focus();
  await page.keyboard.press("Control+v");
  await red("(1:-2.5 20:2 35:2 50:-2.5)");
  await page.getByRole("combobox", { name: "Easing" }).selectOption("smooth");
  await red("(smooth 1:-2.5 20:2 35:2 50:-2.5)");
  await page.getByRole("button", { name: "Repeat" }).click();
  await red("(smooth cycle 1:-2.5 20:2 35:2 50:-2.5)");
  await page.getByRole("button", { name: "Repeat" }).click();
  // By the keyboard alone: to the next key, later, away.
  await page.getByRole("button", { name: /at frame 20:/ }).focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Alt+ArrowRight");
  await red("(smooth 1:-2.5 20:2 36:2 50:-2.5)");
  await page.keyboard.press("Delete");
  await red("(smooth 1:-2.5 20:2 50:-2.5)");
  await page.locator(".track .label").first().click();
  await page.getByRole("button", { name: "Delete keys" }).click();
  await red("-2.5");
  assert.equal(await page.locator(".lane .key").count(), 0);
  studio.check();
});

test("a drag at a frame writes its key, with the switch or where there are keys, and Alt moves them all", async (t) => {
  const studio = await open(t, { text: TEXT });
  const { page } = studio;
  await scrub(page, 26);
  await studio.settled();
  await page.locator(".item", { hasText: "red" }).click();
  const handle = () => page.locator("[data-grip=axis-x] .reach").boundingBox().then(middle);
  const at = await handle();
  await drag(page, at, [at[0] - 30, at[1]]);
  let text = await studio.saved();
  assert.match(line(text, "red"), /^Sphere 0\.8 {3}\(1:-2\.5 26:[-\d.]+ 50:-2\.5\) 0\.8 0 {3}0\.1/);
  await studio.settled();
  await isDrawn(page, studio.path, 26);
  await page.keyboard.press("Control+z");
  await until(async () => Math.abs((await handle())[0] - at[0]) < 0.5);
  // Alt before the press would turn the view.
  await page.mouse.move(...at);
  await page.mouse.down();
  await page.keyboard.down("Alt");
  await page.mouse.move(at[0] - 30, at[1], { steps: 8 });
  await page.mouse.up();
  await page.keyboard.up("Alt");
  text = await studio.saved();
  const [, first, second, third] = line(text, "red").match(/\(1:([-\d.]+) 26:([-\d.]+) 50:([-\d.]+)\)/).map(Number);
  assert.ok(first < -2.6 && Math.abs(first - third) < 1e-9 && Math.abs(second - first - 4.5) < 1e-6, text);
  await page.locator(".item", { hasText: "blue" }).click();
  await page.keyboard.press("Shift+K");
  await page.getByRole("button", { name: "Auto-key", pressed: true }).waitFor();
  await page.locator(".viewport").focus();
  await page.keyboard.press("ArrowRight");
  text = await studio.saved();
  assert.match(line(text, "blue"), /^Sphere 0\.5 {3}\(smooth 1:0 26:[\d.]+\) 0\.5 2 {3}0\.02/);
  // The button in the inspector takes the key away and sets it.
  await page.getByRole("button", { name: /^Key of centre: x, frame 26/, pressed: true }).click();
  await until(async () => line(await studio.saved(), "blue") === line(TEXT, "blue"));
  await page.getByRole("button", { name: /^Key of centre: x, frame 26/ }).click();
  await until(async () => /\(smooth 26:0\)/.test(line(await studio.saved(), "blue")));
  studio.check();
});

test("it plays at its pace, once or again and again", async (t) => {
  const studio = await open(t, { text: TEXT.replace("Frames 50", "Frames 12") });
  const { page } = studio;
  await page.getByRole("button", { name: "Loop", pressed: true }).click();
  const begin = Date.now();
  await page.getByRole("button", { name: "Play" }).click();
  await page.locator("output", { hasText: "frame 12 of 12" }).waitFor();
  await page.getByRole("button", { name: "Play" }).waitFor();
  assert.ok(Date.now() - begin >= 1050, "eleven frames at ten a second");
  await page.getByRole("button", { name: "Loop" }).click();
  // Which frames are seen at all depends on the machine; that they begin anew does not.
  await page.locator("output").evaluate((output) => {
    window.seen = [];
    const look = () => window.seen.push(Number(/\d+/.exec(output.textContent)[0]));
    new MutationObserver(look).observe(output, { characterData: true, childList: true, subtree: true });
  });
  await page.getByRole("button", { name: "Play" }).click();
  const begun = () => page.evaluate(() => window.seen.filter((frame, at) => at > 0 && frame < window.seen[at - 1]).length);
  await until(async () => (await begun()) >= 2);
  await page.getByRole("button", { name: "Stop" }).click();
  await page.getByRole("spinbutton", { name: "Frames", exact: true }).fill("20");
  await page.getByRole("spinbutton", { name: "Frames", exact: true }).press("Enter");
  await until(async () => (await studio.saved()).includes("\nFrames 20\n"));
  await page.locator("output", { hasText: /^frame \d+ of 20$/ }).waitFor();
  studio.check();
});

test("the pace is that of playing and of the GIF, kept where the folder's is", async (t) => {
  const from = mkdtempSync(join(tmpdir(), "rayfold-film-"));
  t.after(() => rmSync(from, { recursive: true, force: true }));
  writeFileSync(join(from, "a.txt"), TEXT.replace("Frames 50", "Frames 6"));
  writeFileSync(join(from, "animation.json"), '{ "loop": 3,\n  "fps": 10 }\n');
  const gif = async ({ page }) => {
    await page.getByRole("button", { name: "Render GIF" }).click();
    const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: /Download GIF/ }).click()]);
    return readFileSync(await download.path());
  };
  const rendered = (path, ...more) => {
    const out = join(from, "expected.gif");
    const run = spawnSync(program, ["render", path, "-o", out, ...more]);
    assert.equal(run.status, 0, String(run.stderr));
    return readFileSync(out);
  };
  const set = async (page, pace) => {
    const field = page.getByRole("spinbutton", { name: "Frames a second" });
    await field.fill(pace);
    await field.press("Enter");
    return field;
  };
  const film = await open(t, { from, name: "film" });
  const settings = () => readFileSync(join(film.path, "animation.json"), "utf8");
  await set(film.page, "4");
  await until(() => settings() === '{ "loop": 3,\n  "fps": 4 }\n');
  await film.page.getByRole("button", { name: "Loop", pressed: true }).click();
  const begin = Date.now();
  await film.page.getByRole("button", { name: "Play" }).click();
  await film.page.locator("output", { hasText: "frame 6 of 6" }).waitFor();
  assert.ok(Date.now() - begin >= 1200, "five frames at four a second");
  assert.ok((await gif(film)).equals(rendered(film.path)), "the folder says it");
  await film.page.locator(".viewport").focus();
  await film.page.keyboard.press("Control+z");
  await until(() => settings() === '{ "loop": 3,\n  "fps": 10 }\n');
  await until(async () => (await film.page.getByRole("spinbutton", { name: "Frames a second" }).inputValue()) === "10");
  const field = await set(film.page, "0");
  await film.page.getByText("Frames a second: expected a number from 0.01 to 1000").waitFor();
  assert.equal(await field.inputValue(), "10");
  film.check();
  const one = await open(t, { text: TEXT.replace("Frames 50", "Frames 6") });
  await set(one.page, "25");
  await until(async () => (await one.page.getByRole("button", { name: "Undo" }).isEnabled()));
  assert.ok((await gif(one)).equals(rendered(one.path, "--fps", "25")), "as the command line is told");
  assert.deepEqual(readdirSync(one.folder), ["scene.txt"]);
  one.check();
});

test("a group is made, picked in the picture, moved, turned and sized as one", async (t) => {
  const studio = await open(t, { text: TEXT });
  const { page } = studio;
  await page.locator(".item", { hasText: "red" }).click();
  await page.locator(".item", { hasText: "blue" }).click({ modifiers: ["Control"] });
  await page.keyboard.press("Control+g");
  await page.locator(".item.use", { hasText: "group1" }).waitFor();
  await studio.saved();
  await studio.settled();
  await isDrawn(page, studio.path, 1);
  await page.locator(".viewport").focus();
  await page.keyboard.press("Escape");
  const blue = await over(page, 0.5, 0.62);
  await page.mouse.move(...blue);
  await page.locator(".under", { hasText: "group1" }).waitFor();
  await until(async () => ((await page.locator(".under-pointer").getAttribute("d")) ?? "").startsWith("M"));
  await drag(page, blue, [blue[0] + 60, blue[1]]);
  const use = async () => (await studio.saved()).split("\n").find((line) => line.startsWith("Use "));
  const moved = await use();
  assert.match(moved, /^Use group1 {2}[-\d.]+ 0 [-\d.]+$/);
  const turn = await page.locator("[data-grip=turn-y] .reach").boundingBox().then(middle);
  await drag(page, turn, [turn[0] + 40, turn[1] + 20]);
  assert.match(await use(), /^Use group1 {2}[-\d.]+ 0 [-\d.]+ 0 -?\d+ 0$/);
  await shot(page, "group");
  const size = await page.locator("[data-grip=scale] .reach").boundingBox().then(middle);
  await drag(page, size, [size[0] + 30, size[1] - 30]);
  assert.match(await use(), / 0 -?\d+ 0 1\.\d+$/);
  await page.getByRole("spinbutton", { name: "rotation: y" }).waitFor();
  await studio.saved();
  await studio.settled();
  await isDrawn(page, studio.path, 1);
  await page.locator(".viewport").focus();
  for (let undone = 0; undone < 4; undone += 1) await page.keyboard.press("Control+z");
  await until(async () => (await studio.saved()) === TEXT);
  studio.check();
});

test("what is locked stays in the picture, and things come to the ground", async (t) => {
  const studio = await open(t, { text: TEXT.replace("0 0.5 2   0.02", "0 1.75 2   0.02") });
  const { page } = studio;
  await page.locator(".item", { hasText: "floor" }).click();
  await page.getByRole("button", { name: "Lock" }).click();
  await page.locator(".item[aria-label$=locked]").waitFor();
  const text = await studio.saved();
  await drag(page, await over(page, 0.3, 0.85), await over(page, 0.4, 0.8));
  assert.equal(await studio.saved(), text, "the view turns instead");
  await page.locator(".item", { hasText: "blue" }).click();
  await page.keyboard.press("g");
  await until(async () => line(await studio.saved(), "blue") === line(TEXT, "blue"));
  studio.check();
});

test("materials are given by their spheres, which the tracer draws anew when they change", async (t) => {
  const studio = await open(t, { text: TEXT });
  const { page } = studio;
  await page.locator(".item", { hasText: "red" }).click();
  await page.locator(".materials").getByRole("button", { name: "gold" }).click();
  await until(async () => /\nMaterial gold {3}[^\n]+\nBox /.test(await studio.saved()));
  assert.match(line(await studio.saved(), "red"), /0\.8 0 {2}gold {3}# red$/);
  const own = page.getByRole("group", { name: "Of this script" }).getByRole("button", { name: "gold" });
  const bytes = async () => {
    const image = own.locator("img");
    await until(() => image.evaluate((image) => image.complete && image.naturalWidth === 96));
    return image.evaluate(async (image) => [...new Uint8Array(await (await fetch(image.src)).arrayBuffer())].join());
  };
  const before = await bytes();
  await page.keyboard.press("Escape");
  await own.click();
  await page.getByRole("button", { name: "Channels of colour" }).click();
  await page.getByLabel("colour: blue, slider").press("End");
  await until(async () => /diffuse 0\.3 0\.17 1 /.test(await studio.saved()));
  await until(async () => (await bytes()) !== before);
  await studio.saved();
  await studio.settled();
  await isDrawn(page, studio.path, 1);
  studio.check();
});

test("axe finds nothing in timeline, groups and materials, light and dark", async (t) => {
  for (const scheme of ["light", "dark"]) {
    await t.test(scheme, async (t) => {
      const studio = await open(t, { text: MATERIALS, scheme });
      const { page } = studio;
      await page.locator(".track .label").first().click();
      await page.locator(".track.selected").first().waitFor();
      await page.getByText("Starter materials").click();
      await page.getByRole("button", { name: "chalk" }).scrollIntoViewIfNeeded();
      await studio.settled();
      await shot(page, `timeline-${scheme}`);
      assert.deepEqual(await audit(page), []);
      await page.getByRole("listbox").focus();
      await page.keyboard.press("Home");
      for (let down = 0; down < 2; down += 1) await page.keyboard.press("ArrowDown");
      await page.getByRole("heading", { name: "glow Material" }).waitFor();
      await studio.settled();
      await shot(page, `material-${scheme}`);
      assert.deepEqual(await audit(page), []);
      studio.check();
    });
  }
});

test("a script of one frame says how it becomes an animation, and a folder that each script is a frame", async (t) => {
  const one = await open(t, { text: TEXT.replace("Frames 50\n", "").replace("(1:-2.50 26:2 50:-2.5)", "0") });
  await one.page.getByRole("button", { name: "Animate" }).waitFor();
  assert.equal(await number(one.page).count(), 0);
  one.check();
  const folder = await open(t, { from: join(scenes, "hello"), name: "hello" });
  await folder.page.getByText("Keys need one script").waitFor();
  folder.check();
});
