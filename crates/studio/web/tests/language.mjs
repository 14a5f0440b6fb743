// All of the language is on the page: each parameter of each command and clause is reached there, and what only the table
// of the language says decides which those are. A new command or parameter that the page cannot reach fails here.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { audit, drag, open, over, program, clickRow, shot, until } from "./stage.mjs";

const table = () => {
  const checked = spawnSync(program, ["check", "--format", "json", "-"], { input: "Screen 4 3\nLook 0 0 9 0 0 0 40\nTrace\n" });
  return JSON.parse(String(checked.stdout)).language;
};

/** Writes a picture of a pixel beside the script. */
const addPicture = (folder) => {
  const png = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGOoLGoFAAJtAS9RtyNWAAAAAElFTkSuQmCC";
  writeFileSync(join(folder, "dot.png"), Buffer.from(png, "base64"));
};

const SCENE = "Screen 64 36\nLook 0 2 9  0 0.5 0  40\nIlight 1 1 1  1 -1 -1\nTrace\n";

/** The words of a line before its comment, a curve being one. */
const words = (line) => line.split("#")[0].match(/\([^)]*\)|[^\s,]+/g) ?? [];

/** Changes every number that the inspector shows within a part of the page. */
async function changeAll(studio, within) {
  const { page } = studio;
  const folded = within.locator("[aria-expanded=false]");
  // The page may unfold or draw anew in between, so a click may find nothing.
  await until(async () => {
    await page.waitForTimeout(100);
    if ((await folded.count()) === 0) return true;
    await folded.first().click({ timeout: 2000 }).catch(() => {});
    return false;
  });
  const count = await within.getByRole("spinbutton").count();
  for (let at = 0; at < count; at += 1) {
    const field = within.getByRole("spinbutton").nth(at);
    const name = await field.getAttribute("aria-label");
    if (/^sun (azimuth|height)$/.test(name)) continue;
    const old = await field.inputValue();
    const now = Number(old);
    await field.fill(String(Number.isInteger(now) ? now + 1 : now / 2));
    await field.press("Enter");
    await page.waitForTimeout(60);
  }
}

test("every parameter of every command is reached on the page", async (t) => {
  const language = table();
  assert.ok(language.commands.length > 20);
  const studio = await open(t, { text: SCENE, size: [1440, 900] });
  writeFileSync(join(studio.folder, "corner.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  addPicture(studio.folder);
  const { page } = studio;
  const inspector = page.locator(".panel.inspector");
  const line = async (command) => (await studio.saved()).split("\n").findLast((line) => words(line)[0] === command);
  for (const { name, parameters, subject } of language.commands) {
    if (parameters.length === 0) continue;
    await page.locator(".viewport").focus();
    await page.keyboard.press("Escape");
    let within = inspector;
    const tile = page.locator(".tile", { has: page.getByText(name, { exact: true }) });
    const isQuoted = subject?.role === "quotes";
    if (subject && !isQuoted) {
      // What refers to a name is made with it: here a group, from an object.
      await page.locator(".tile", { hasText: "Sphere" }).click();
      await page.locator(".item.object[aria-selected=true]").waitFor();
      await page.locator(".viewport").focus();
      await page.keyboard.press("Control+g");
      await page.locator(".item.use[aria-selected=true]").waitFor();
    } else if (name === "Camera" || name === "Look") {
      await page.getByLabel("camera", { exact: true }).selectOption(name);
      await until(async () => (await line(name)) !== undefined);
      await page.getByRole("button", { name: "Edit", exact: true }).first().click();
    } else if (await tile.count()) {
      // A mesh is made of a model beside the script, a text of letters.
      await tile.click();
    } else if (!isQuoted && (await page.locator(`.tile[title^="${name}:"]`).count())) {
      await page.locator(`.tile[title^="${name}:"]`).click();
    } else {
      // Of two settings with one name the page shows the word that one of them takes.
      const title = isQuoted ? `${name} "FILE"` : name;
      const chip = inspector.locator(`.chips button[title^='${title}:']`);
      within = inspector.locator(`section[title='${title}']`);
      await until(async () => (await within.count()) > 0 || (await chip.click({ timeout: 2000 }).catch(() => {}), false));
    }
    await until(async () => (await line(name)) !== undefined);
    if (within === inspector) await inspector.locator(".subject .note", { hasText: name }).waitFor();
    const before = words(await line(name)).slice(subject ? 2 : 1);
    const numbers = parameters.filter(({ words }) => !words).flatMap(({ names }) => names).length;
    if (numbers > 0) await within.getByRole("spinbutton").or(within.locator("[aria-expanded=false]")).first().waitFor();
    await changeAll(studio, within);
    // Angles of a sun are the direction in other words.
    const shown = () => within.getByRole("spinbutton").evaluateAll((all) => all.filter(({ ariaLabel }) => !/^sun (azimuth|height)$/.test(ariaLabel)).length);
    await until(async () => (await shown()) === numbers).catch(async () => assert.fail(`${name}: ${await shown()} numbers on the page, not ${numbers}`));
    for (const { words: allowed } of parameters.filter(({ words }) => words)) {
      const select = within.locator("select").first();
      const now = await select.inputValue();
      await select.selectOption(allowed.find((word) => word !== now));
    }
    await until(async () => {
      const after = words(await line(name)).slice(subject ? 2 : 1);
      const count = parameters.flatMap(({ names }) => names).length;
      return after.length === count && after.every((word, at) => word !== before[at]);
    }).catch(async () => assert.fail(`${name}: ${before} became ${await line(name)}`));
    // What follows starts from a sound scene.
    const undo = page.getByRole("button", { name: "Undo" });
    while (await undo.isEnabled()) await undo.evaluate((button) => button.click());
  }
  studio.check();
});

test("every clause of a material is switched on and off, and a sphere shows it", async (t) => {
  const { clauses } = table();
  const studio = await open(t, { text: SCENE, size: [1440, 900] });
  addPicture(studio.folder);
  const { page } = studio;
  await page.getByRole("button", { name: "New material" }).click();
  const switches = page.getByRole("group", { name: "Clauses" }).getByRole("button");
  await until(async () => (await switches.count()) === clauses.length);
  await until(async () => (await page.locator(".card img").count()) === 1);
  const material = async () => (await studio.saved()).split("\n").find((line) => line.startsWith("Material material-1 "));
  for (const [at, { name, parameters, subject, ends_with: other }] of clauses.entries()) {
    const has = async () => words(await material()).includes(name);
    if (!(await has())) {
      await switches.nth(at).click();
      await until(has);
    }
    const text = words(await material());
    const from = text.indexOf(name) + (subject ? 2 : 1);
    const required = parameters.filter(({ presence }) => presence === "required");
    const numbers = required.filter(({ words }) => !words).flatMap(({ names }) => names).length;
    assert.ok(text.slice(from, from + numbers).every((word) => Number.isFinite(Number(word))), `${text}`);
    const fields = page.locator(".panel.inspector .field");
    await until(async () => (await fields.count()) >= required.length).catch(() => assert.fail(`${name} has no fields`));
    if (other) await page.getByLabel("other material").waitFor();
    if (name !== "diffuse") {
      await switches.nth(at).click();
      await until(async () => !(await has()));
    }
  }
  // The last clause stays.
  await page.getByRole("group", { name: "Clauses" }).getByRole("button", { name: "colour", exact: true }).click();
  await page.getByText("needs one clause").waitFor();
  studio.check();
});

test("a material is dropped on an object, taken off again, and a group is used from the palette", async (t) => {
  const text = SCENE.replace("Trace", "Material red diffuse 1 0 0\nSphere 1  0 0.5 0  0.1 0.1 0.1  0.5 0.5 0.5   # ball\nTrace");
  const studio = await open(t, { text, size: [1440, 900] });
  const { page } = studio;
  await studio.settled();
  const [x, y] = await over(page, 0.5, 0.5);
  const box = await page.locator(".viewport").boundingBox();
  const at = { targetPosition: { x: x - box.x, y: y - box.y } };
  const ball = async () => (await studio.saved()).split("\n").find((line) => line.endsWith("# ball"));
  await page.locator(".sphere", { hasText: "red" }).dragTo(page.locator(".viewport"), at);
  await until(async () => words(await ball()).at(-1) === "red");
  await page.getByText("Starter materials").click();
  await page.locator(".sphere", { hasText: "gold" }).dragTo(page.locator(".viewport"), at);
  await until(async () => words(await ball()).at(-1) === "gold");
  await clickRow(page, ".item", { hasText: "ball" });
  await page.getByLabel("material", { exact: true }).selectOption("red");
  await until(async () => words(await ball()).at(-1) === "red");
  await page.getByLabel("material", { exact: true }).selectOption("");
  await until(async () => (await ball()).includes("0 0 0 1 0 0"));
  await page.locator(".viewport").focus();
  await page.keyboard.press("Control+g");
  await page.locator(".tile.use").waitFor();
  await page.locator(".tile.use").click();
  await until(async () => (await studio.saved()).match(/^Use /gm).length === 2);
  studio.check();
});

test("a camera is an object: seen from elsewhere, moved, and looked through", async (t) => {
  const text = SCENE.replace("Trace", "Sphere 1  0 0.5 0  0.1 0.1 0.1  0.5 0.5 0.5   # ball\nTrace");
  const studio = await open(t, { text, size: [1440, 900] });
  const { page } = studio;
  await page.getByRole("button", { name: "Top", exact: true }).click();
  await page.locator(".frustum").waitFor();
  await page.locator(".item.camera").click();
  await page.mouse.move(...(await over(page, 0.5, 0.5)));
  for (let turn = 0; turn < 6; turn += 1) await page.mouse.wheel(0, 240);
  await studio.settled();
  await shot(page, "camera");
  const handle = page.locator("[data-grip=axis-x] .dot").first();
  const dot = await handle.boundingBox();
  await drag(page, [dot.x + 3, dot.y + 3], [dot.x + 63, dot.y + 3]);
  const camera = async () => (await studio.saved()).split("\n").find((line) => line.startsWith("Look"));
  await until(async () => Number(words(await camera())[1]) > 0);
  await page.getByRole("button", { name: "Look through" }).click();
  await until(async () => (await page.getByRole("button", { name: "Camera", exact: true }).getAttribute("aria-pressed")) === "true");
  assert.equal(await page.locator(".frustum").count(), 0);
  studio.check();
});

test("soft light without samples is pointed out, and one click mends it", async (t) => {
  const text = SCENE.replace("1 -1 -1", "1 -1 -1  5").replace("Trace", "Plane 0 0 0  0 1 0  .1 .1 .1 .5 .5 .5\nTrace");
  const studio = await open(t, { text, size: [1440, 900] });
  const { page } = studio;
  await page.locator(".item.light").click();
  await page.getByRole("button", { name: "Use 16 samples" }).click();
  await until(async () => (await studio.saved()).includes("Samples 16"));
  await page.getByRole("button", { name: "Use 16 samples" }).waitFor({ state: "detached" });
  assert.deepEqual(await audit(page), []);
  await page.locator(".viewport").focus();
  await page.keyboard.press("Escape");
  await studio.settled();
  await shot(page, "settings");
  assert.deepEqual(await audit(page), []);
  studio.check();
});
