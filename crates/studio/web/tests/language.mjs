// Clauses, materials, cameras and lights on the page. The journeys (`journeys.mjs`) change each parameter of the language.

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
