// Examples, files of one's own and new names, in a real browser: `node --test`, with RAYFOLD (the program) and CHROMIUM.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";

import { audit, open, output, program, scenes, setLine, shot, until } from "./stage.mjs";

const text = "Screen 320 180\nCamera 0 1 8  0 0 -1  0 1 0  1  -.8 -.45  .8 .45\nIlight 1 1 1 1 -1 -1\nSphere 1 0 1 0 .1 .1 .1 .8 .2 .2\nTrace\n";

test("an example comes in place of the text as one step, and a file of one's own too", async (t) => {
  const { page, path, settled, saved, check } = await open(t, { text, name: "mine.txt" });
  await page.getByRole("button", { name: "File", exact: true }).click();
  await page.getByLabel("Example: hello").check();
  await shot(page, "file");
  assert.deepEqual(await audit(page), []);
  assert.equal(await page.getByRole("button", { name: "Save as" }).count(), 0, "one script was opened");
  await page.getByRole("button", { name: "Replace mine.txt" }).click();
  const hello = readFileSync(join(scenes, "hello/frame01.txt"), "utf8");
  await until(() => readFileSync(path, "utf8") === hello);
  await settled();
  await page.locator(".viewport").focus();
  await page.keyboard.press("Control+z");
  await until(() => readFileSync(path, "utf8") === text);

  const folder = mkdtempSync(join(tmpdir(), "rayfold-own-"));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  const own = join(folder, "own.txt");
  writeFileSync(own, `# my own \u00e4\r\n${text}`);
  await page.getByRole("button", { name: "File", exact: true }).click();
  await page.getByLabel("Choose a file").setInputFiles(own);
  await page.getByLabel("Your file own.txt").waitFor();
  await page.getByRole("button", { name: "Replace mine.txt" }).click();
  await until(() => readFileSync(path).equals(readFileSync(own)));
  await saved();

  await page.getByRole("button", { name: "File", exact: true }).click();
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: "Download mine.txt" }).click()]);
  assert.ok(readFileSync(await download.path()).equals(readFileSync(own)), "as it stands");
  check();
});

test("a new name goes into the folder that was opened, over no other file and to no other place", async (t) => {
  const from = mkdtempSync(join(tmpdir(), "rayfold-film-"));
  t.after(() => rmSync(from, { recursive: true, force: true }));
  for (const name of ["f1.txt", "f10.txt"]) writeFileSync(join(from, name), text);
  const { page, path, folder, check } = await open(t, { from, name: "film" });
  writeFileSync(join(path, "theirs.txt"), "# theirs\n");
  const saveAs = async (name) => {
    await page.getByRole("button", { name: "File", exact: true }).click();
    await page.getByLabel("New script of the folder").fill(name);
    await page.getByRole("button", { name: "Save as" }).click();
  };
  for (const [name, why] of [
    ["f1", "there is such a file already"],
    ["theirs.txt", "there is such a file already"],
    ["../out", "expected a plain file name"],
    [".hidden", "expected a plain file name"],
  ]) {
    await saveAs(name);
    await page.getByText(why).waitFor();
    await page.getByRole("button", { name: "Close" }).click();
  }
  await saveAs("f2");
  await page.locator("output", { hasText: "frame 2 of 3" }).waitFor();
  assert.equal(readFileSync(join(path, "f2.txt"), "utf8"), text);
  await setLine(page, 4, "# gone");
  await until(() => readFileSync(join(path, "f2.txt"), "utf8").includes("# gone"));
  for (const name of ["f1.txt", "f10.txt"]) assert.equal(readFileSync(join(path, name), "utf8"), text);
  assert.equal(readFileSync(join(path, "theirs.txt"), "utf8"), "# theirs\n");
  assert.deepEqual(readdirSync(folder), ["film"]);
  check();
});

test("all frames and all scripts come as zip files", async (t) => {
  const from = mkdtempSync(join(tmpdir(), "rayfold-film-"));
  t.after(() => rmSync(from, { recursive: true, force: true }));
  for (let frame = 1; frame <= 12; frame += 1) writeFileSync(join(from, `f${frame}.txt`), text);
  const { page, check } = await open(t, { from, name: "film" });
  for (const [name, first] of [["Frames", "frame01.png"], ["Scripts", "f1.txt"]]) {
    const [download] = await Promise.all([page.waitForEvent("download"), (await output(page, name)).click()]);
    const bytes = readFileSync(await download.path());
    assert.equal(bytes.readUInt16LE(bytes.lastIndexOf(Buffer.from([0x50, 0x4b, 5, 6])) + 10), 12, name);
    assert.ok(bytes.includes(first), first);
  }
  check();
});

test("a GIF that is being made can be given up, and is made anew", async (t) => {
  const film = (size, samples, frames) =>
    `Screen ${size}\nSamples ${samples}\nFrames ${frames}\nLook 0 2 8  0 1 0  40\nIlight 1 1 1  1 -2 -1\nSphere 1  (1:-2 ${frames}:2) 1 0  .1 .1 .1  .5 .6 .7  .4 .4 .4\nTrace\n`;
  const studio = await open(t, { text: film("1600 1200", 1024, 300) });
  const { page, path, folder } = studio;
  await page.getByRole("button", { name: "Render GIF" }).click();
  await page.getByRole("progressbar", { name: "Frames drawn" }).waitFor();
  assert.deepEqual(await audit(page), []);
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.getByRole("button", { name: "Render GIF" }).waitFor();
  assert.equal(await page.getByRole("link", { name: /Download GIF/ }).count(), 0, "half of one is none");
  writeFileSync(path, film("96 64", 4, 5));
  await page.locator("output", { hasText: "frame 1 of 5" }).waitFor();
  await page.getByRole("button", { name: "Render GIF" }).click();
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: /Download GIF/ }).click()]);
  const run = spawnSync(program, ["render", path, "-o", join(folder, "expected.gif")]);
  assert.equal(run.status, 0, String(run.stderr));
  assert.ok(readFileSync(await download.path()).equals(readFileSync(join(folder, "expected.gif"))), "the same bytes");
  studio.check();
});
