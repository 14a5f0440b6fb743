// Drives the page in a real browser, against a real server: `node --test`, with RAYFOLD (the program) and CHROMIUM.
// Each test has a folder and a server of its own (`stage.mjs`).

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { request } from "node:http";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";

import { audit, caret, drag, goLine, half, isDrawn, open, over, program, clickRow, scenes, seenLines, selectLine, setLine, shot, until } from "./stage.mjs";

test("the viewport's pixels are the tracer's, also after a drag", async (t) => {
  const studio = await open(t, { from: join(scenes, "hello/frame01.txt") });
  const { page } = studio;
  for (let round = 0; round < 2; round += 1) {
    await studio.settled();
    await isDrawn(page, studio.path);
    if (round === 0) {
      await drag(page, await over(page, 0.66, 0.67), await over(page, 0.55, 0.72));
      assert.notEqual(await studio.saved(), readFileSync(join(scenes, "hello/frame01.txt"), "utf8"));
    }
  }
  studio.check();
});

test("an arrow key changes one line of one file of an example, and the viewport shows it as the tracer draws it", async (t) => {
  for (const name of half(t, readdirSync(scenes).filter((name) => !name.includes(".")))) {
    await t.test(name, async (t) => {
      const from = join(scenes, name);
      // A small window, as some of them take many rays a pixel.
      const studio = await open(t, { from, name, size: [820, 380] });
      // It is moved while its picture gets finer. A model and letters have no place of their own: the group that uses them has it.
      await clickRow(studio.page, '.item.object:not([aria-label^="Mesh "], [aria-label^="Text "])');
      await studio.page.locator(".viewport").focus();
      await studio.page.keyboard.press("ArrowRight");
      const changed = () =>
        readdirSync(from).flatMap((file) => {
          const [old, now] = [from, studio.path].map((folder) => readFileSync(join(folder, file), "utf8").split("\n"));
          assert.equal(old.length, now.length, file);
          return old.filter((line, at) => line !== now[at]);
        });
      await until(() => changed().length > 0);
      assert.equal(changed().length, 1, changed().join("\n"));
      await studio.settled();
      await isDrawn(studio.page, studio.path);
      studio.check();
    });
  }
});

test("what takes long is there at once, with few pixels, and then becomes the picture", async (t) => {
  const text = readFileSync(join(scenes, "lamp/lamp.txt"), "utf8").replace(/^Samples.*$/m, "Samples 4096 0");
  const studio = await open(t, { text });
  const shown = () => studio.page.locator("canvas").evaluate(({ width, dataset }) => ({ width, final: dataset.final }));
  const first = await shown();
  assert.equal(first.final, "false");
  await until(async () => (await shown()).width > 300, 120_000);
  // It can be worked with meanwhile.
  await clickRow(studio.page, ".item.object");
  await studio.page.locator(".viewport").focus();
  await studio.page.keyboard.press("ArrowRight");
  await until(async () => (await studio.saved()) !== text);
  assert.equal((await shown()).final, "false");
  studio.check();
});

test("five objects from an empty page without a number, and the GIF is that of the command line", async (t) => {
  const studio = await open(t, { text: "", name: "mine.txt" });
  const { page } = studio;
  const add = page.locator(".palette");
  for (const name of ["Box", "Sphere", "Sphere"]) await add.getByRole("button", { name, exact: true }).click();
  await studio.settled();
  const target = page.locator(".viewport");
  const box = await target.boundingBox();
  for (const [name, x, y] of [["Sphere", 0.3, 0.6], ["Triangle", 0.7, 0.6]]) {
    await add.getByRole("button", { name, exact: true }).dragTo(target, { targetPosition: { x: x * box.width, y: y * box.height } });
  }
  await page.locator(".item.object").nth(4).waitFor();
  const handle = page.locator("[data-grip=axis-x] .reach");
  const at = await handle.boundingBox();
  const middle = [at.x + at.width / 2, at.y + at.height / 2];
  await drag(page, middle, [middle[0] + 60, middle[1]]);
  await page.getByRole("button", { name: "Channels of colour" }).click();
  await page.getByLabel("colour: red, slider").press("ArrowRight");
  const text = await studio.saved();
  assert.equal(text.split("\n").filter((line) => /^(Box|Sphere|Triangle) /.test(line)).length, 5, text);
  await shot(page, "five-objects");
  await page.getByRole("button", { name: "Render GIF" }).click();
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.getByRole("link", { name: /Download GIF/ }).click(),
  ]);
  const expected = join(studio.folder, "expected.gif");
  const run = spawnSync(program, ["render", studio.path, "-o", expected]);
  assert.equal(run.status, 0, String(run.stderr));
  assert.ok(readFileSync(await download.path()).equals(readFileSync(expected)), "the same bytes");
  for (let undone = 0; undone < 40; undone += 1) await page.keyboard.press("Control+z");
  await until(async () => (await studio.saved()) === "");
  studio.check();
});

test("the script and the picture follow each other, and faults are told where they are", async (t) => {
  const studio = await open(t, { from: join(scenes, "hello/frame01.txt") });
  const { page } = studio;
  await clickRow(page, ".item", { hasText: "Sphere" });
  const ball = page.locator(".cm-line.chosen");
  await ball.waitFor();
  const text = await ball.textContent();
  assert.match(text, /^Sphere/);
  await setLine(page, 34, text.replace("Sphere", "Spere"));
  await page.locator(".wave.error").waitFor();
  await page.locator(".mark.error").waitFor();
  await page.getByRole("button", { name: /did you mean `Sphere`?/ }).waitFor();
  await shot(page, "fault");
  await setLine(page, 34, text.replace("Sphere 0.72", "Sphere 0.5"));
  await page.locator(".wave.error").waitFor({ state: "detached" });
  await until(async () => (await page.getByRole("spinbutton", { name: "radius" }).inputValue()) === "0.5");
  await studio.settled();
  await studio.saved();
  await isDrawn(page, studio.path);
  studio.check();
});

test("what is typed stays, whatever is told meanwhile", async (t) => {
  const text = Array.from({ length: 3000 }, (_, at) => `# ${at}`).join("\n") + `\n${readFileSync(join(scenes, "hello/frame01.txt"), "utf8")}`;
  const studio = await open(t, { text });
  const { page } = studio;
  const typed = "Sphere 0.25  1 2 3  0.1 0.1 0.1  0.5 0.5 0.5   # typed, not pasted";
  await goLine(page, 2);
  await selectLine(page);
  await page.keyboard.type(typed);
  assert.equal((await caret(page)).text, typed);
  await until(async () => (await studio.saved()).split("\n")[1] === typed);
  // Numbers, and names, while the script changes elsewhere.
  await clickRow(page, ".item.object");
  const radius = page.getByRole("spinbutton", { name: "radius" });
  await radius.focus();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("1.2");
  writeFileSync(studio.path, (await studio.saved()).replace("# 7\n", "# seven\n"));
  await page.getByText("was changed on the disk").waitFor();
  assert.equal(await radius.inputValue(), "1.2");
  await page.keyboard.type("5");
  await page.keyboard.press("Enter");
  await until(async () => (await studio.saved()).split("\n")[1].startsWith("Sphere 1.25 "));
  await page.getByRole("listbox").focus();
  await page.keyboard.press("F2");
  const name = page.getByLabel("Name of Sphere");
  await name.waitFor();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("half a na");
  writeFileSync(studio.path, (await studio.saved()).replace("# 8\n", "# eight\n"));
  await until(async () => (await seenLines(page)).includes("# eight"));
  await page.keyboard.type("me");
  await page.keyboard.press("Enter");
  await until(async () => (await studio.saved()).split("\n")[1].endsWith("# half a name"));
  // What is no number is told, and what holds comes back.
  await radius.fill("1e400").catch(() => {});
  await radius.focus();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("1e400");
  await page.keyboard.press("Enter");
  await page.getByText("radius: expected a number").waitFor();
  assert.equal(await radius.inputValue(), "1.25");
  studio.check();
});

test("lines change their order by buttons and by keys, and nothing else", async (t) => {
  const ball = (x, name) => `Sphere 1  ${x} 0 0  .1 .1 .1  1 1 1  # ${name}`;
  const text = `Screen 96 64\nLook 0 1 9  0 0 0  40\n${ball(-2, "left")}\n${ball(2, "right")}\nTrace\n`;
  const studio = await open(t, { text });
  const { page } = studio;
  await page.locator(".item", { hasText: "left" }).click();
  await page.getByRole("button", { name: "Down the list" }).click();
  await until(() => readFileSync(studio.path, "utf8") === `Screen 96 64\nLook 0 1 9  0 0 0  40\n${ball(2, "right")}\n${ball(-2, "left")}\nTrace\n`);
  await page.getByRole("listbox").focus();
  await page.keyboard.press("Alt+ArrowUp");
  await until(() => readFileSync(studio.path, "utf8") === text);
  studio.check();
});

test("what another program writes meanwhile is never overwritten", async (t) => {
  const studio = await open(t, { from: join(scenes, "hello/frame01.txt") });
  const { page, path } = studio;
  const text = readFileSync(path, "utf8");
  writeFileSync(path, text.replace("# H", "# another H"));
  await page.getByText("was changed on the disk").waitFor();
  await until(async () => (await seenLines(page)).includes("# another H"));
  // A change on both sides before either is told: the page must ask.
  await setLine(page, 1, "# mine");
  writeFileSync(path, "# theirs\n");
  await page.getByRole("button", { name: "Keep what is here" }).waitFor();
  assert.equal(readFileSync(path, "utf8"), "# theirs\n");
  await page.getByRole("button", { name: "Keep what is here" }).click();
  await until(async () => readFileSync(path, "utf8").startsWith("# mine\n"));
  studio.check();
});

test("frames are scrubbed, and each is the tracer's picture", async (t) => {
  const studio = await open(t, { from: join(scenes, "hello"), name: "hello" });
  const { page } = studio;
  await page.getByRole("slider", { name: "Frame" }).fill("20");
  await page.locator("output", { hasText: "frame 20 of 50" }).waitFor();
  await studio.settled();
  await isDrawn(page, studio.path, 20);
  await page.getByRole("button", { name: "Play" }).click();
  await until(async () => !(await page.locator("output", { hasText: "frame 20 of 50" }).isVisible()));
  await page.getByRole("button", { name: "Stop" }).click();
  studio.check();
});

test("a draft leaves out indirect light, and then it is there again", async (t) => {
  const scene = (indirect) =>
    `Screen 96 64\nSamples 16\nIndirect ${indirect}\nLook 0 1 6  0 0 0  50\nBackground .7 .8 .9\nSphere 1  0 0 0  0 0 0  .8 .4 .2\nPlane 0 -1 0  0 1 0  0 0 0  .6 .6 .6\nTrace\n`;
  const studio = await open(t, { text: scene(2) });
  const { page } = studio;
  await studio.settled();
  await isDrawn(page, studio.path);
  const draft = page.getByRole("button", { name: "Draft", exact: true });
  await draft.click();
  await page.locator("button[aria-pressed=true]", { hasText: "Draft" }).waitFor();
  await studio.settled();
  const without = `${studio.path}.without.txt`;
  writeFileSync(without, scene(0));
  await isDrawn(page, without);
  assert.equal(readFileSync(studio.path, "utf8"), scene(2), "the script stays as it is");
  await page.keyboard.press("Shift+D");
  await studio.settled();
  await isDrawn(page, studio.path);
  studio.check();
});

test("a free camera turns, and becomes that of the script", async (t) => {
  const studio = await open(t, { from: join(scenes, "hello/frame01.txt") });
  const { page } = studio;
  const text = readFileSync(studio.path, "utf8");
  await page.getByRole("button", { name: "Top", exact: true }).click();
  await studio.settled();
  await shot(page, "top");
  await drag(page, await over(page, 0.02, 0.05), await over(page, 0.1, 0.02));
  assert.equal(readFileSync(studio.path, "utf8"), text, "looking around changes nothing");
  await page.getByRole("button", { name: "Keep this view" }).click();
  await until(async () => readFileSync(studio.path, "utf8") !== text);
  await studio.settled();
  await isDrawn(page, studio.path);
  const differ = readFileSync(studio.path, "utf8").split("\n").filter((line, at) => line !== text.split("\n")[at]);
  assert.equal(differ.length, 1);
  assert.match(differ[0], /^Camera /);
  studio.check();
});

test("an empty, a broken and a huge script open and stay usable", async (t) => {
  const sphere = (at) => `Sphere 1 ${(at % 400) - 200} ${Math.floor(at / 400) - 125} 0  .1 .1 .1  1 1 1`;
  const huge = `Screen 160 90\nCamera 0 0 500  0 0 -1  0 1 0  1  -.8 -.45  .8 .45\nIlight 1 1 1 0 0 -1\n${Array.from({ length: 100_000 }, (_, at) => sphere(at)).join("\n")}\nTrace\n`;
  for (const [name, text] of Object.entries({ "broken.txt": "Spere 1\n\u0000\nScreen", "huge.txt": huge })) {
    await t.test(name, async (t) => {
      const folder = mkdtempSync(join(tmpdir(), "rayfold-text-"));
      t.after(() => rmSync(folder, { recursive: true, force: true }));
      const from = join(folder, name);
      writeFileSync(from, text);
      const studio = await open(t, { from, name, blank: name === "broken.txt" });
      await setLine(studio.page, 1, "Screen 320 180");
      await until(async () => readFileSync(studio.path, "utf8").startsWith("Screen 320 180\n"));
      assert.equal(readFileSync(studio.path, "utf8").split("\n").length, text.split("\n").length);
      if (name === "huge.txt") assert.ok((await studio.page.locator("body *").count()) < 3000, "only rows in sight are made");
      studio.check();
    });
  }
});

test("axe finds nothing, light and dark, and the keyboard reaches all", async (t) => {
  for (const scheme of ["light", "dark"]) {
    await t.test(scheme, async (t) => {
      const studio = await open(t, { from: join(scenes, "hello"), name: "hello", scheme });
      const { page } = studio;
      await page.getByRole("listbox").focus();
      for (let down = 0; down < 17; down += 1) await page.keyboard.press("ArrowDown");
      await page.getByRole("spinbutton", { name: "radius" }).waitFor();
      await studio.settled();
      await shot(page, scheme);
      assert.deepEqual(await audit(page), []);
      const handle = page.locator("[data-grip=length]");
      await handle.focus();
      const before = await page.getByRole("spinbutton", { name: "radius" }).inputValue();
      await page.keyboard.press("ArrowRight");
      await until(async () => (await page.getByRole("spinbutton", { name: "radius" }).inputValue()) !== before);
      await page.locator(".viewport").focus();
      await page.keyboard.press("?");
      await page.getByRole("dialog").waitFor();
      await shot(page, `keys-${scheme}`);
      assert.deepEqual(await audit(page), []);
      studio.check();
    });
  }
});

test("only who knows the address gets in, and only from this page", async (t) => {
  const studio = await open(t, { from: join(scenes, "hello/frame01.txt") });
  const url = new URL(studio.address);
  const get = (path, headers = {}) =>
    new Promise((resolve, reject) => {
      const sent = request({ host: url.hostname, port: url.port, path, headers }, (answer) => {
        answer.resume();
        resolve(answer.statusCode);
      });
      sent.on("upgrade", (answer, socket) => {
        socket.destroy();
        resolve(101);
      });
      sent.on("error", reject);
      sent.end();
    });
  const upgrade = {
    Connection: "Upgrade",
    Upgrade: "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
  };
  const socket = `${url.pathname}socket`;
  assert.equal(await get(url.pathname), 200);
  assert.equal(await get("/"), 403);
  assert.equal(await get(`/${"0".repeat(32)}/`), 403);
  assert.equal(await get(url.pathname.slice(0, -2) + "/"), 403);
  assert.equal(await get(url.pathname, { Host: "evil.example" }), 403);
  assert.equal(await get(url.pathname, { Host: `localhost:${url.port}` }), 403);
  assert.equal(await get(url.pathname, { Origin: "http://evil.example" }), 403);
  assert.equal(await get(socket, upgrade), 403, "a socket says from where it is opened");
  assert.equal(await get(socket, { ...upgrade, Origin: "http://evil.example" }), 403);
  assert.equal(await get(socket, { ...upgrade, Origin: url.origin }), 101);
  for (const path of ["../Cargo.toml", "%2e%2e/scene.txt", "scene.txt", "frame.png/../../scene.txt"]) {
    assert.notEqual(await get(url.pathname + path), 200, path);
  }
});

test("what is dragged is refined while it is held, and the page says that it is simplified until then", async (t) => {
  // Balls of glass behind each other, which take too long with all their mirror images.
  const balls = Array.from({ length: 60 }, (_, at) => `Sphere 0.45 ${(at % 5) - 2} ${(Math.floor(at / 5) % 4) - 1.5} ${-Math.floor(at / 20)} clear`);
  const text = `Screen 400 300\nDepth 14\nBackground 0.6 0.7 0.9\nLook 0 0 9  0 0 0  36\nIlight 1 1 1  1 -1 -1\nMaterial clear glass 0.98 0.98 0.98 1.5\n${balls.join("\n")}\nSphere 0.5  0 0 2  clear\nTrace\n`;
  const { page, settled, check } = await open(t, { text, size: [1024, 768] });
  const canvas = page.locator("canvas");
  const seen = () => canvas.evaluate(({ width, height, dataset }) => ({ width, height, isFinal: dataset.final === "true" }));
  const note = page.getByText("Mirrors and glass are simplified while this moves");
  await settled();
  const whole = await seen();
  await canvas.evaluate((canvas) => {
    window.least = 1e9;
    canvas.addEventListener("picture", () => (window.least = Math.min(window.least, canvas.width)));
  });
  const [x, y] = await over(page, 0.5, 0.5);
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let step = 1; !(await note.isVisible()); step += 1) {
    assert.ok(step < 200, "nothing is simplified");
    await page.mouse.move(x + (step % 20), y);
    await page.waitForTimeout(30);
  }
  assert.ok((await page.evaluate(() => window.least)) >= whole.width / 4, "at least a quarter");
  // The button is still down.
  await until(async () => (await seen()).isFinal);
  assert.deepEqual(await seen(), whole);
  assert.equal(await note.count(), 0);
  await page.mouse.up();
  await settled();
  check();
});

test("pictures keep up with a drag, and what was changed is written when the server is told to end", async (t) => {
  const studio = await open(t, { from: join(scenes, "hello/frame01.txt") });
  const { page } = studio;
  await studio.settled();
  const text = readFileSync(studio.path, "utf8");
  await page.locator("canvas").evaluate((canvas) => {
    window.shown = 0;
    canvas.addEventListener("picture", () => (window.shown += 1));
  });
  await drag(page, await over(page, 0.66, 0.67), await over(page, 0.4, 0.75), 60);
  const shown = await page.evaluate(() => window.shown);
  assert.ok(shown >= 3, `${shown} pictures in a drag of 60 steps`);
  studio.server.kill("SIGTERM");
  assert.equal(await studio.ended, 0);
  assert.notEqual(readFileSync(studio.path, "utf8"), text);
  await page.getByText("The connection was lost").waitFor();
});
