// Random edits by pointer and keys, in all parts of the page: undoing all of them restores every byte of the file, and
// doing them again ends in the same bytes.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { drag, goLine, open, over, random, until } from "./stage.mjs";

/** The number of edits that change the file; `EDITS` sets another one. */
const EDITS = Number(process.env.EDITS ?? 25);

/** Lines of all kinds, with both line ends, a byte-order mark, and no end of the last line. */
const TEXT =
  "\uFEFF# a scene\r\nScreen 320 180\nLook 0 3 9  0 0.5 0  40\r\nIlight 1 1 1  .5 -1 -.3   # sun\n\nMaterial grey diffuse .5 .50 (1:.5 50:.2)\n" +
  "\tSphere 1.0 , -2 (smooth 1:1 9:2) 0  .1 .1 .1 .9 .2 .2   # ball\nBox 0 0 -1  1.5 1 1  grey\r\nGroup table\nCylinder .5  0 0 0  0 1 0  grey\nEnd\n" +
  "Use table  2.5 0 1   # one\nPlane 0 0 0  0 1 0  .1 .1 .1 .5 .5 .5\nFrames 9\nTrace\n# \u20AC the end";

test(`${EDITS} random edits, undone and redone, are byte-exact`, async (t) => {
  const below = random(t, 20261128);
  const studio = await open(t, { text: TEXT, size: [1200, 760] });
  const { page } = studio;
  const viewport = page.locator(".viewport");
  const anywhere = () => over(page, 0.1 + 0.8 * below(1000) / 1000, 0.2 + 0.7 * below(1000) / 1000);
  const fields = page.locator(".panel.inspector").getByRole("spinbutton");
  /** A random one of what there is, if there is any. It may be gone soon. */
  const one = async (locator) => {
    const all = await locator.elementHandles();
    return all[below(Math.max(all.length, 1))];
  };
  const center = async (locator) => {
    const box = await (await one(locator))?.boundingBox();
    return box && [box.x + box.width / 2, box.y + box.height / 2];
  };
  const click = async (locator) => {
    const at = await center(locator);
    if (at) await page.mouse.click(...at);
  };
  const edits = {
    drag: async () => drag(page, await anywhere(), await anywhere(), 3),
    handle: async () => {
      const from = await center(page.locator(".handle .dot"));
      if (from) await drag(page, from, [from[0] + below(80) - 40, from[1] + below(60) - 30], 3);
    },
    "giving up": async () => {
      await page.mouse.move(...(await anywhere()));
      await page.mouse.down();
      await page.mouse.move(...(await anywhere()), { steps: 3 });
      await page.keyboard.press("Escape");
      await page.mouse.up();
    },
    scrub: async () => {
      const from = await center(fields);
      if (from) await drag(page, from, [from[0] + below(60) - 30, from[1]], 3);
    },
    number: async () => {
      const found = await one(fields);
      const isFocused = (await found?.isVisible()) && (await found.focus().then(() => true, () => false));
      if (!isFocused) return;
      await page.keyboard.type(String(below(300) / 100));
      await page.keyboard.press("Enter");
    },
    key: async () => {
      await viewport.focus();
      await page.keyboard.press(["ArrowLeft", "Shift+ArrowUp", "Control+d", "h", "g", "d", "k", "Control+g", "Control+Shift+G", "Delete"][below(10)]);
    },
    text: async () => {
      await goLine(page, 1 + below(18));
      await page.keyboard.type(["# typed", "Sphere .5 1 1 1  .1 .1 .1 .2 .7 .2\n", "\n", "9"][below(4)]);
      await page.keyboard.press("Escape");
    },
    "deleted text": async () => {
      await goLine(page, 1 + below(18));
      for (let count = 1 + below(12); count > 0; count -= 1) await page.keyboard.press("Delete");
    },
    add: () => click(page.locator(".tile.object, .tile.light")),
    material: () => click(page.getByRole("button", { name: "New material" })),
  };
  const names = Object.keys(edits);
  const done = [];
  let before = TEXT;
  for (let tries = 0; done.length < EDITS; tries += 1) {
    assert.ok(tries < 10 * EDITS, "most edits change something");
    if (below(2) === 0) await click(page.locator(".item"));
    const name = names[below(names.length)];
    await edits[name]();
    const after = await studio.saved();
    if (after !== before) done.push(name);
    before = after;
  }
  t.diagnostic(done.join(", "));
  const [undo, redo] = ["Undo", "Redo"].map((name) => page.getByRole("button", { name, exact: true }));
  const text = async () => (await fetch(`${studio.address}script.txt?0`)).text();
  /** Presses a key until nothing is left to do. Returns how often the text changed. */
  const all = async (key, button) => {
    let steps = 0;
    let now = await text();
    while (await button.isEnabled()) {
      const before = now;
      await page.keyboard.press(key);
      // The page learns last that nothing is left.
      await until(async () => (now = await text()) !== before || !(await button.isEnabled()));
      if (now !== before) steps += 1;
    }
    // The browser has steps of its own, and must not take them.
    for (let more = 0; more < 3; more += 1) await page.keyboard.press(key);
    await studio.saved();
    return steps;
  };
  await viewport.focus();
  const undone = await all("Control+z", undo);
  assert.ok(undone >= EDITS / 2, `${undone} steps`);
  assert.equal(readFileSync(studio.path, "utf8"), TEXT);
  assert.equal(await all("Control+Shift+Z", redo), undone);
  assert.equal(readFileSync(studio.path, "utf8"), before);
  studio.check();
});

test("where no step is left, the browser takes none of its own", async (t) => {
  const studio = await open(t, { text: TEXT, size: [1200, 760] });
  const { page } = studio;
  const undo = page.getByRole("button", { name: "Undo", exact: true });
  for (const line of [2, 16]) {
    await goLine(page, line);
    for (const key of ["9", "8", "Enter", "7"]) await page.keyboard.press(key);
  }
  await studio.saved();
  await page.evaluate(() => {
    window.foreign = 0;
    addEventListener("beforeinput", (event) => setTimeout(() => (window.foreign += /^history/.test(event.inputType) && !event.defaultPrevented)), true);
  });
  const viewport = page.locator(".viewport");
  await viewport.focus();
  while (await undo.isEnabled()) await page.keyboard.press("Control+z");
  for (let more = 0; more < 3; more += 1) await page.keyboard.press("Control+z");
  await studio.saved();
  assert.equal(await page.evaluate(() => window.foreign), 0);
  assert.equal(readFileSync(studio.path, "utf8"), TEXT);
  assert.ok(await viewport.evaluate((own) => own === document.activeElement), "the focus stays");
  studio.check();
});
