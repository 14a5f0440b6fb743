// The editor of the script: what is typed is what is written, at any speed, and the editor helps with the language.

import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { audit, caret, drag, goLine, open, over, random, scenes, seenLines, setLine, shot, until } from "./stage.mjs";

const text = "Screen 320 180\nLook 0 1 8  0 0 0  40\nIlight 1 1 1 1 -1 -1\nSphere 1 0 1 0 .1 .1 .1 .8 .2 .2\nTrace\n";

/** The number of lines that are typed at once; `LINES` sets another one. */
const LINES = Number(process.env.LINES ?? 40);

/** Lines of all kinds, different each time. */
function written(count) {
  const kinds = [
    (n) => `Sphere ${(n % 7) / 10 + 0.1} ${n % 5} 0.${n} -2  .1 .1 .1  .5 .5 .${n % 10}  # ball ${n}`,
    (n) => `# a comment (${n}), with "quotes" and äöü €`,
    () => "",
    (n) => `  Ilight .1 .1 .1  ${n} -1 -1`,
    (n) => `Material m${n} diffuse .5 .5 .5 shine 1 1 1 ${n + 1}`,
    (n) => `Sphere .1 (smooth 1:${n} 9:2) 0 0 m${n - 1}`,
  ];
  return Array.from({ length: count }, (_, n) => kinds[n % kinds.length](n));
}

for (const [delay, count] of [[0, LINES], [5, 12], [30, 6], [60, 6]]) {
  test(`${count} lines typed at ${delay} ms a key are the lines of the file`, async (t) => {
    const studio = await open(t, { text });
    const { page } = studio;
    const lines = written(count);
    await page.locator(".cm-content").focus();
    await page.keyboard.press("Control+a");
    for (const [at, line] of lines.entries()) {
      if (at > 0) await page.keyboard.press("Enter");
      await page.keyboard.type(line, { delay });
    }
    await page.keyboard.press("Escape");
    const expected = lines.join("\n");
    await until(() => readFileSync(studio.path, "utf8") === expected);
    // And undo brings back every byte. It takes long, so the shorter texts stand for all.
    for (let undone = 0; count < 13 && readFileSync(studio.path, "utf8") !== text; undone += 1) {
      assert.ok(undone < 600, "undo ends");
      for (let at = 0; at < 25; at += 1) await page.keyboard.press("Control+z");
      await studio.saved();
    }
    studio.check();
  });
}

test(`${LINES} lines typed at 0 to 60 ms a key, with slips of the finger, are the lines of the file`, async (t) => {
  const below = random(t, 20261128);
  const studio = await open(t, { text });
  const { page } = studio;
  const lines = Array.from({ length: LINES }, (_, at) => ["# ", "Depth ", "", "Samples "][below(4)] + at);
  await page.locator(".cm-content").focus();
  await page.keyboard.press("Control+a");
  const pause = async () => {
    const delay = below(61);
    // Half of the keys follow at once.
    if (delay % 2 === 0) await page.waitForTimeout(delay);
  };
  for (const [at, line] of lines.entries()) {
    if (at > 0) await page.keyboard.press("Enter");
    for (const key of line) {
      await pause();
      if (below(20) === 0) {
        await page.keyboard.type("x");
        await pause();
        await page.keyboard.press("Backspace");
      }
      await page.keyboard.type(key);
    }
  }
  await page.keyboard.press("Escape");
  await until(() => readFileSync(studio.path, "utf8") === lines.join("\n"));
  studio.check();
});

test("Enter splits a line at once, and a paste of several lines stays several lines", async (t) => {
  const studio = await open(t, { text });
  const { page, context } = studio;
  await context.grantPermissions(["clipboard-read", "clipboard-write"]);
  await goLine(page, 2);
  await page.keyboard.type("Samples 16\nDepth 3\n");
  await page.evaluate(() => navigator.clipboard.writeText("# one\r\n# two\n# three"));
  await page.keyboard.press("Control+v");
  const head = "Screen 320 180\nSamples 16\nDepth 3\n# one\n# two\n# three";
  await until(() => readFileSync(studio.path, "utf8") === text.replace("Screen 320 180\n", head));
  studio.check();
});

test("what is typed while an object is dragged and a file changes is kept", async (t) => {
  const studio = await open(t, { text });
  const { page } = studio;
  await goLine(page, 1);
  const typed = "# typed while everything else moves, without the loss of a letter";
  // Another program writes the file again and again, each time another line of it.
  let writes = 0;
  const writer = setInterval(() => {
    const now = readFileSync(studio.path, "utf8");
    writeFileSync(studio.path, now.replace(/Trace.*\n$/, `Trace # ${(writes += 1)}\n`));
  }, 700);
  t.after(() => clearInterval(writer));
  await page.keyboard.type(`${typed}\n`, { delay: 40 });
  clearInterval(writer);
  await page.getByText(/saved|not saved/).waitFor();
  // If both wrote at once, the page has asked.
  const keep = page.getByRole("button", { name: "Keep what is here" });
  if (await keep.isVisible()) await keep.click();
  await until(() => readFileSync(studio.path, "utf8").startsWith(`${typed}\nScreen`));
  // The editor shows what the file holds.
  await until(async () => (await seenLines(page)).join("\n") === readFileSync(studio.path, "utf8"));
  await drag(page, await over(page, 0.5, 0.37), await over(page, 0.6, 0.5), 30);
  await until(async () => (await seenLines(page)).join("\n") === readFileSync(studio.path, "utf8"));
  studio.check();
});

test("deleted text joins lines, and leaves no style that the page's policy refuses", async (t) => {
  const studio = await open(t, { text: "Screen 320 180   # wide\n# ab\nSphere 1 2\nTrace\n", blank: true });
  const { page, path } = studio;
  const holds = (text) => until(async () => readFileSync(path, "utf8") === text && (await seenLines(page)).join("\n") === text);
  await goLine(page, 2);
  await page.keyboard.press("Backspace");
  await holds("Screen 320 180   # wide# ab\nSphere 1 2\nTrace\n");
  await page.keyboard.press("End");
  for (let times = 0; times < 4; times += 1) await page.keyboard.press("Delete");
  await holds("Screen 320 180   # wide# abere 1 2\nTrace\n");
  await page.keyboard.press("Shift+ArrowDown");
  await page.keyboard.press("Backspace");
  // Several carets delete each their own character.
  await page.keyboard.press("Control+Home");
  await page.keyboard.insertText("\u{1F600}b\ncd\n");
  await page.keyboard.press("ArrowUp");
  await page.keyboard.press("Control+Alt+ArrowUp");
  await page.keyboard.press("Delete");
  await until(() => readFileSync(path, "utf8").startsWith("b\nd\nScreen"));
  studio.check();
});

test("several carets, moved lines and line ends of both kinds change no other byte", async (t) => {
  const mixed = "\uFEFFScreen 320 180\r\n# a\n# b\r\n# c\nTrace";
  const studio = await open(t, { text: mixed, blank: true });
  const { page, path } = studio;
  await goLine(page, 2);
  await page.keyboard.press("Control+Alt+ArrowDown");
  await page.keyboard.press("Control+Alt+ArrowDown");
  await page.keyboard.type("## ");
  await until(() => readFileSync(path, "utf8") === "\uFEFFScreen 320 180\r\n## # a\n## # b\r\n## # c\nTrace");
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+z");
  await until(() => readFileSync(path, "utf8") === mixed);
  await page.keyboard.press("Escape");
  await goLine(page, 5);
  await page.keyboard.press("Control+/");
  await until(() => readFileSync(path, "utf8").endsWith("\n# Trace"));
  studio.check();
});

test("commands, clauses and names are completed from the parser's table", async (t) => {
  const studio = await open(t, { text: `Material gold diffuse .5 .4 .1\n${text}` });
  const { page, path } = studio;
  await goLine(page, 5);
  await page.keyboard.type("\n");
  await page.keyboard.press("ArrowUp");
  await page.keyboard.type("sph");
  await page.getByRole("listbox", { name: "Completions" }).waitFor();
  await page.getByRole("listbox", { name: "Completions" }).getByRole("option", { name: /^Sphere/ }).waitFor();
  await shot(page, "completion");
  assert.deepEqual(await audit(page), []);
  await page.keyboard.press("Tab");
  await page.keyboard.type(" 1  0 0 0  g");
  await page.getByRole("listbox", { name: "Completions" }).getByRole("option", { name: /^gold/ }).waitFor();
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  await page.keyboard.type("\nMaterial blue mir");
  await page.getByRole("listbox", { name: "Completions" }).getByRole("option", { name: /^mirror/ }).waitFor();
  // Enter ends the line: it takes nothing that was not chosen.
  await page.keyboard.type("\n");
  await page.getByRole("listbox", { name: "Completions" }).waitFor({ state: "detached" });
  await until(() => readFileSync(path, "utf8").includes("\nSphere 1  0 0 0  gold\nMaterial blue mir\n\nSphere 1 0 1 0"));
  await page.keyboard.type('Material blue image "a b.png" f');
  await page.getByRole("listbox", { name: "Completions" }).getByRole("option", { name: /^flat/ }).waitFor();
  studio.check();
});

test("help comes under the pointer, problems into the margin, and groups and comments fold", async (t) => {
  const folded = "# a scene\n# of two lines\nGroup table\nSphere 1 0 1 0 .1 .1 .1 .8 .2 .2\nEnd\nUse table 1 0 0\n";
  const studio = await open(t, { text: folded + text });
  const { page, path } = studio;
  await page.locator(".w-number", { hasText: /^40$/ }).hover();
  await page.locator(".help", { hasText: "degrees" }).waitFor();
  await page.locator(".w-command", { hasText: "Ilight" }).hover();
  await page.locator(".help .usage", { hasText: "Ilight" }).waitFor();
  await setLine(page, 8, "Look 0 1 8  0 0 0  400");
  await page.locator(".mark.error").waitFor();
  await page.keyboard.press("F8");
  assert.deepEqual(await caret(page), { text: "Look 0 1 8  0 0 0  400", column: 19 });
  await page.keyboard.press("Control+z");
  await page.locator(".mark.error").waitFor({ state: "detached" });
  const before = (await seenLines(page)).length;
  await page.locator(".arrows span").first().click();
  await page.locator(".arrows span").nth(1).click();
  await page.locator(".dots").nth(1).waitFor();
  assert.equal((await seenLines(page)).length, before - 2);
  await shot(page, "folded");
  await page.locator(".dots").first().click();
  await until(async () => (await seenLines(page)).length === before - 1);
  await studio.saved();
  assert.equal(readFileSync(path, "utf8"), folded + text);
  studio.check();
});

test("a search finds, and replaces as one step", async (t) => {
  const studio = await open(t, { from: join(scenes, "hello/frame01.txt") });
  const { page, path } = studio;
  const before = readFileSync(path, "utf8");
  await page.locator(".cm-content").focus();
  await page.keyboard.press("Control+f");
  await page.getByRole("textbox", { name: "Find" }).fill("Sphere");
  await page.getByRole("textbox", { name: "Replace" }).fill("Torus");
  assert.deepEqual(await audit(page), []);
  await page.getByRole("button", { name: "replace all" }).click();
  await until(() => readFileSync(path, "utf8") === before.replaceAll("Sphere", "Torus"));
  await page.locator(".cm-content").focus();
  await page.keyboard.press("Control+z");
  await until(() => readFileSync(path, "utf8") === before);
  studio.check();
});

test("what is typed around undo and redo is kept in its order, and so is the caret, also if the replies are late", async (t) => {
  const steps = ["Home", "# ab", "undo", "# c", "undo", "redo", "d", "undo", "undo", "redo", "Enter", "# e", "undo", "f", "Backspace", "undo", "redo", "# g", "undo", "undo", "h"];
  const keys = { undo: "Control+z", redo: "Control+Shift+Z" };
  const run = async (late, pause) => {
    const studio = await open(t, { text });
    const { page, path } = studio;
    if (late > 0) {
      await page.routeWebSocket(/socket/, (socket) => {
        const server = socket.connectToServer();
        socket.onMessage((message) => server.send(message));
        server.onMessage((message) => setTimeout(() => socket.send(message), late));
      });
      await page.reload();
      await until(async () => (await page.locator("canvas").getAttribute("data-picture")) !== null);
    }
    await goLine(page, 4);
    for (const what of steps) {
      if (/^[#a-z]/.test(what) && !(what in keys)) await page.keyboard.type(what);
      else await page.keyboard.press(keys[what] ?? what);
      await page.waitForTimeout(pause);
    }
    await page.waitForTimeout(1000 + 10 * late);
    await studio.saved();
    const last = readFileSync(path, "utf8");
    assert.equal((await seenLines(page)).join("\n"), last, "the editor shows the file");
    studio.check();
    return { last, caret: await caret(page) };
  };
  const slow = await run(0, 400);
  for (const late of [0, 150]) {
    const fast = await run(late, 0);
    assert.deepEqual(fast, slow, `replies after ${late} ms`);
  }
});

test("undo and redo leave the caret where it is, and put it behind what they bring back", async (t) => {
  const studio = await open(t, { text });
  const { page, path } = studio;
  const is = (file, column, line) =>
    until(async () => {
      const now = await caret(page);
      return readFileSync(path, "utf8") === file && now.column === column && now.text === line;
    }, 10_000);
  const line = (at, by) => text.split("\n").with(at, by).join("\n");
  await goLine(page, 1);
  await page.keyboard.press("End");
  await page.keyboard.type(" # abc");
  await is(line(0, "Screen 320 180 # abc"), 20, "Screen 320 180 # abc");
  await page.keyboard.press("Control+z");
  await is(text, 14, "Screen 320 180");
  await page.keyboard.press("Control+y");
  await is(line(0, "Screen 320 180 # abc"), 20, "Screen 320 180 # abc");
  await page.keyboard.type("d");
  await is(line(0, "Screen 320 180 # abcd"), 21, "Screen 320 180 # abcd");
  // A line end within a line, taken back and done again.
  await goLine(page, 4);
  for (let times = 0; times < 6; times += 1) await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  const split = line(0, "Screen 320 180 # abcd").replace("Sphere ", "Sphere\n ");
  await is(split, 0, " 1 0 1 0 .1 .1 .1 .8 .2 .2");
  await page.keyboard.press("Control+z");
  await is(line(0, "Screen 320 180 # abcd"), 6, "Sphere 1 0 1 0 .1 .1 .1 .8 .2 .2");
  await page.keyboard.press("Control+y");
  await is(split, 0, " 1 0 1 0 .1 .1 .1 .8 .2 .2");
  // A step elsewhere leaves the caret alone.
  await page.keyboard.press("Control+z");
  await is(line(0, "Screen 320 180 # abcd"), 6, "Sphere 1 0 1 0 .1 .1 .1 .8 .2 .2");
  await page.keyboard.press("Control+z");
  await page.keyboard.press("Control+z");
  await is(text, 6, "Sphere 1 0 1 0 .1 .1 .1 .8 .2 .2");
  studio.check();
});
