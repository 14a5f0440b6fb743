// What a designer does first: objects are taken by their bodies, the view is turned everywhere, fields and dialogs take
// their keys, and nothing is done that is not seen.

import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";

import { audit, drag, open, over, clickRow, scenes, shot, until } from "./stage.mjs";

const HEAD = "Screen 320 180\nLook 0 3 9  0 0.5 0  40\nIlight 1 1 1 1 -1 -1\n";
const FLOOR = "Plane 0 0 0  0 1 0  .1 .1 .1 .5 .5 .5   # floor\n";
const ball = (radius, x, y, z, name) => `Sphere ${radius}  ${x} ${y} ${z}  .1 .1 .1  .8 .2 .2   # ${name}\n`;

/** Where a point of the world is in the window, for the camera of `HEAD`. */
async function seen(page, x, y, z) {
  const eye = [0, 3, 9];
  const back = [0, 2.5 / Math.hypot(2.5, 9), 9 / Math.hypot(2.5, 9)];
  const up = [0, back[2], -back[1]];
  const to = [x - eye[0], y - eye[1], z - eye[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const box = await page.locator("canvas").boundingBox();
  const half = Math.tan((20 * Math.PI) / 180);
  const scale = box.height / 2 / half / -dot(to, back);
  return [box.x + box.width / 2 + to[0] * scale, box.y + box.height / 2 - dot(to, up) * scale];
}

const numbers = (text, name) => text.split("\n").find((line) => line.endsWith(`# ${name}`)).split(/\s+/).slice(1, 5).map(Number);

test("a small ball is moved by its body, also when it is selected, and the radius by its handle", async (t) => {
  const text = HEAD + FLOOR + ball(0.06, 0.4, 0.06, 2, "small") + "Trace\n";
  const studio = await open(t, { text });
  const { page } = studio;
  await studio.settled();
  let [radius, x, y, z] = numbers(text, "small");
  for (let time = 0; time < 5; time += 1) {
    const at = await seen(page, x, y, z);
    await drag(page, at, [at[0] + 30, at[1] + (time % 2 === 0 ? 20 : -20)]);
    const now = numbers(await studio.saved(), "small");
    assert.equal(now[0], radius, "the radius stays");
    assert.equal(now[2], y, "it stays on its height");
    assert.ok(now[1] > x + 0.05 && Math.abs(now[3] - z) > 0.05, `${now}`);
    [radius, x, y, z] = now;
  }
  const handle = await page.locator("[data-grip=length] .dot").boundingBox();
  const from = [handle.x + handle.width / 2, handle.y + handle.height / 2];
  const body = await seen(page, x, y, z);
  assert.ok(Math.hypot(from[0] - body[0], from[1] - body[1]) > 20, "it is beside the ball");
  await drag(page, from, [from[0] + 40, from[1]]);
  assert.ok(numbers(await studio.saved(), "small")[0] > 0.1);
  studio.check();
});

test("the floor turns the view and stays, Alt and the middle button do everywhere, and a click selects it", async (t) => {
  const text = HEAD + FLOOR + ball(1, 0, 1, 0, "ball") + "Trace\n";
  const studio = await open(t, { text });
  const { page } = studio;
  await studio.settled();
  const camera = page.getByRole("button", { name: "Camera", exact: true });
  const isScript = () => camera.getAttribute("aria-pressed");
  const [floor, body] = [await seen(page, -2, 0, 2), await seen(page, 0, 1, 0)];
  const turns = async (act) => {
    await camera.click();
    await until(async () => (await isScript()) === "true");
    await act();
    await until(async () => (await isScript()) === "false");
  };
  await turns(() => drag(page, floor, [floor[0] + 60, floor[1] + 20]));
  await turns(async () => {
    await page.keyboard.down("Alt");
    await drag(page, body, [body[0] + 60, body[1]]);
    await page.keyboard.up("Alt");
  });
  for (const [button, shift] of [["middle", false], ["middle", true], ["right", false]]) {
    await turns(async () => {
      if (shift) await page.keyboard.down("Shift");
      await page.mouse.move(...body);
      await page.mouse.down({ button });
      await page.mouse.move(body[0] + 50, body[1] + 10, { steps: 5 });
      await page.mouse.up({ button });
      if (shift) await page.keyboard.up("Shift");
    });
  }
  for (const key of ["Alt+ArrowLeft", "Alt+Shift+ArrowUp", "+", "-"]) {
    await turns(async () => {
      await page.locator(".viewport").focus();
      await page.keyboard.press(key);
    });
  }
  await turns(async () => {
    await page.mouse.move(...body);
    await page.mouse.wheel(0, -200);
  });
  await camera.click();
  await studio.settled();
  assert.equal(readFileSync(studio.path, "utf8"), text, "looking around changes nothing");
  await page.mouse.click(...floor);
  await page.locator(".item[aria-selected=true]", { hasText: "floor" }).waitFor();
  studio.check();
});

test("dialogs take the keys, and Escape closes the dialog alone", async (t) => {
  const text = HEAD + ball(1, 0, 1, 0, "ball") + "Trace\n";
  const studio = await open(t, { text });
  const { page } = studio;
  await page.locator(".item", { hasText: "ball" }).click();
  await page.locator(".viewport").focus();
  await page.keyboard.press("?");
  await page.getByRole("dialog").waitFor();
  for (const key of ["Delete", "h", "d", "Control+d", "ArrowLeft"]) await page.keyboard.press(key);
  await page.keyboard.press("Escape");
  await page.getByRole("dialog").waitFor({ state: "detached" });
  assert.equal(await page.locator(".item[aria-selected=true]").count(), 1, "the selection stays");
  await page.waitForTimeout(1200);
  assert.equal(readFileSync(studio.path, "utf8"), text);
  await page.keyboard.press("Escape");
  await until(async () => (await page.locator(".item[aria-selected=true]").count()) === 0);
  studio.check();
});

test("undo works in number fields and sliders, and a comma is a decimal point", async (t) => {
  const text = HEAD + ball(1, 0, 1, 0, "ball") + "Trace\n";
  const studio = await open(t, { text });
  const { page } = studio;
  await page.locator(".item", { hasText: "ball" }).click();
  const radius = page.getByRole("spinbutton", { name: "radius" });
  await radius.focus();
  await page.keyboard.press("Control+a");
  await page.keyboard.type("1,5");
  await page.keyboard.press("Enter");
  await until(async () => numbers(await studio.saved(), "ball")[0] === 1.5);
  // A value that is not committed is taken back first, then the step before it.
  await page.keyboard.type("7");
  await page.keyboard.press("Control+z");
  assert.equal(await radius.inputValue(), "1.5");
  await page.keyboard.press("Control+z");
  await until(async () => (await studio.saved()) === text);
  await until(async () => (await radius.inputValue()) === "1");
  await page.keyboard.press("Tab");
  await page.waitForTimeout(900);
  assert.equal(await studio.saved(), text, "leaving the field writes nothing");
  const slider = page.getByLabel("radius, slider");
  await slider.focus();
  await page.keyboard.press("ArrowRight");
  await until(async () => (await studio.saved()) !== text);
  await page.keyboard.press("Control+z");
  await until(async () => (await studio.saved()) === text);
  await page.keyboard.press("Control+Shift+Z");
  await until(async () => (await studio.saved()) !== text);
  studio.check();
});

test("a drag across a number field changes it as one step, finely with Shift, and Escape gives up", async (t) => {
  const text = HEAD + ball("1.0", 0, 1, 0, "ball") + "Trace\n";
  const studio = await open(t, { text });
  const { page } = studio;
  await page.locator(".item", { hasText: "ball" }).click();
  const radius = page.getByRole("spinbutton", { name: "radius" });
  const middle = async () => {
    const box = await radius.boundingBox();
    return [box.x + box.width / 2, box.y + box.height / 2];
  };
  const [x, y] = await middle();
  const value = () => radius.inputValue();
  // Five pixels are a step of an arrow key.
  await drag(page, [x, y], [x + 40, y + 3]);
  await until(async () => (await value()) === "1.8");
  assert.equal(numbers(await studio.saved(), "ball")[0], 1.8);
  assert.equal(await radius.evaluate((field) => field === document.activeElement), false, "a drag is no click");
  await page.keyboard.press("Control+z");
  await until(async () => (await studio.saved()) === text);
  assert.equal(await page.getByRole("button", { name: "Undo", exact: true }).isEnabled(), false, "it is one step");
  await page.keyboard.down("Shift");
  await drag(page, [x, y], [x + 40, y]);
  await page.keyboard.up("Shift");
  await until(async () => (await value()) === "1.08");
  await page.keyboard.press("Control+z");
  await until(async () => (await studio.saved()) === text);
  // It stops at the limits of the table: a radius is not negative.
  await drag(page, [x, y], [x - 200, y]);
  await until(async () => (await value()) === "0");
  assert.equal(numbers(await studio.saved(), "ball")[0], 0);
  await page.keyboard.press("Control+z");
  await until(async () => (await studio.saved()) === text);
  // What is given up leaves the bytes as they were, and no step. The selection stays.
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 30, y, { steps: 4 });
  await until(async () => (await value()) === "1.6");
  await page.keyboard.press("Escape");
  await until(async () => (await value()) === "1");
  await page.mouse.move(x + 60, y, { steps: 4 });
  await page.mouse.up();
  assert.equal(await studio.saved(), text);
  for (const name of ["Undo", "Redo"]) assert.equal(await page.getByRole("button", { name, exact: true }).isEnabled(), false, name);
  assert.equal(await page.locator(".item[aria-selected=true]").count(), 1);
  // The same of a body in the picture.
  const at = await seen(page, 0, 1, 0);
  await page.mouse.move(...at);
  await page.mouse.down();
  await page.mouse.move(at[0] + 40, at[1], { steps: 4 });
  await until(async () => (await page.getByRole("button", { name: "Undo", exact: true }).isEnabled()));
  await page.keyboard.press("Escape");
  await until(async () => !(await page.getByRole("button", { name: "Undo", exact: true }).isEnabled()));
  await page.mouse.move(at[0] + 80, at[1], { steps: 4 });
  await page.mouse.up();
  assert.equal(await studio.saved(), text);
  // A click goes into the field, which takes what is typed, and a drag selects its text.
  await page.mouse.click(x, y);
  await page.keyboard.type("2");
  await drag(page, [x, y], [x + 20, y]);
  assert.equal(await value(), "2");
  await page.keyboard.press("Enter");
  await until(async () => numbers(await studio.saved(), "ball")[0] === 2);
  await page.keyboard.type("-3");
  await page.keyboard.press("Enter");
  await page.getByText("expected a number from 0").waitFor();
  assert.equal(await value(), "2");
  // The search opens from a field, too.
  await page.keyboard.press("Control+k");
  await page.getByRole("dialog", { name: "Search" }).waitFor();
  studio.check();
});

test("light and dark change all colours, and the page remembers which, and its panels", async (t) => {
  const studio = await open(t, { text: `${HEAD}Trace\n`, blank: true });
  const { page } = studio;
  const colour = () => page.locator(".bar").evaluate((bar) => getComputedStyle(bar).backgroundColor);
  const light = await colour();
  await page.getByRole("button", { name: "Light or dark" }).click();
  const dark = await colour();
  assert.notEqual(dark, light);
  const width = async () => (await page.locator(".viewport").boundingBox()).width;
  const before = await width();
  const line = await page.getByRole("separator", { name: "Width of the right panels" }).boundingBox();
  await drag(page, [line.x + 3, line.y + 200], [line.x - 97, line.y + 200]);
  await until(async () => Math.abs(before - (await width()) - 100) < 2);
  await page.getByRole("separator", { name: "Width of the left panels" }).focus();
  await page.keyboard.press("ArrowLeft");
  await until(async () => Math.abs(before - (await width()) - 84) < 2);
  await page.getByRole("button", { name: "Materials" }).click();
  await page.reload();
  await page.locator(".viewport").waitFor();
  assert.equal(await colour(), dark);
  await until(async () => Math.abs(before - (await width()) - 84) < 2);
  assert.equal(await page.getByRole("button", { name: "Materials" }).getAttribute("aria-expanded"), "false");
  studio.check();
});

test("a page without its studio takes nothing, and says so", async (t) => {
  const text = HEAD + ball(1, 0, 1, 0, "ball") + "Trace\n";
  const studio = await open(t, { text });
  const { page } = studio;
  await studio.settled();
  studio.server.kill("SIGKILL");
  await page.getByText("not connected").waitFor();
  await page.locator(".cm-content").click();
  await page.keyboard.type("lost");
  assert.ok(!(await page.locator(".cm-content").innerText()).includes("lost"));
  assert.equal(await page.getByText("saving").count(), 0);
  assert.deepEqual(await audit(page), []);
});

test("a material and a group are renamed wherever they are named", async (t) => {
  const text = `${HEAD}Material gold diffuse .5 .4 .1\nGroup pair\nSphere .5 0 0 0 gold\nEnd\nUse pair 1 0 0\nSphere 1 -1 0 0 gold\nTrace\n`;
  const studio = await open(t, { text });
  const { page } = studio;
  await studio.settled();
  // A busy browser draws no frame between two keys. They are for the field of the name nevertheless.
  await page.evaluate(() => {
    const frame = window.requestAnimationFrame;
    window.requestAnimationFrame = (then) => setTimeout(() => frame(then), 200);
  });
  for (const [selector, old, name] of [[".item.material", "gold", "brass"], [".item.group", "pair", "couple"]]) {
    await clickRow(page, selector, { hasText: old });
    await page.getByRole("listbox").focus();
    await page.keyboard.press("F2");
    await page.keyboard.press("Control+a");
    await page.keyboard.type(name);
    await page.keyboard.press("Enter");
    await page.locator(selector, { hasText: name }).waitFor();
  }
  await until(async () => (await studio.saved()) === text.replaceAll("gold", "brass").replaceAll("pair", "couple"));
  studio.check();
});

test("new objects stand beside each other, and a plane is a grey ground", async (t) => {
  const studio = await open(t, { text: "", name: "mine.txt" });
  const { page } = studio;
  for (const name of ["Sphere", "Sphere", "Sphere", "Box"]) {
    await page.locator(".palette").getByRole("button", { name, exact: true }).click();
    await studio.settled();
  }
  await page.locator(".palette").getByRole("button", { name: "Plane", exact: true }).click();
  await page.locator(".item.object").nth(4).waitFor();
  const text = await studio.saved();
  const balls = text.split("\n").filter((line) => line.startsWith("Sphere")).map((line) => line.split(/\s+/).slice(1, 5).map(Number));
  for (const [at, a] of balls.entries()) {
    for (const b of balls.slice(at + 1)) assert.ok(Math.hypot(a[1] - b[1], a[2] - b[2], a[3] - b[3]) >= a[0] + b[0], text);
  }
  const plane = text.split("\n").find((line) => line.startsWith("Plane")).split(/\s+/).slice(1).map(Number);
  assert.deepEqual(plane.slice(0, 6), [0, 0, 0, 0, 1, 0]);
  const [red, green, blue] = plane.slice(9, 12);
  assert.ok(Math.max(red, green, blue) - Math.min(red, green, blue) < 0.1, text);
  studio.check();
});

test("the ruler's frames are above the keys, and keys behind the last frame are there", async (t) => {
  const many = Array.from({ length: 12 }, (_, n) => `Sphere .2  (1:${n} 20:${n + 1} 60:0) (1:0 40:1) 0  .1 .1 .1 .5 .5 .5\n`).join("");
  const studio = await open(t, { text: `${HEAD}${many}Frames 40\nTrace\n` });
  const { page } = studio;
  await page.locator(".lane .key").first().waitFor();
  const [ruler, lane] = await Promise.all([page.locator(".ruler .lane").boundingBox(), page.locator(".tracks .list .lane").first().boundingBox()]);
  assert.ok(Math.abs(ruler.x - lane.x) < 0.6 && Math.abs(ruler.width - lane.width) < 0.6, JSON.stringify([ruler, lane]));
  await page.getByRole("button", { name: /at frame 60:/ }).first().waitFor();
  assert.equal(await page.getByText("Keys need one script").count(), 0);
  await shot(page, "keys-behind");
  studio.check();
});

test("an empty folder and a new one are opened, and names show what they hide", async (t) => {
  const folder = mkdtempSync(join(tmpdir(), "rayfold-empty-"));
  t.after(() => rmSync(folder, { recursive: true, force: true }));
  const name = "evil\u202Etxt.gnp";
  writeFileSync(join(folder, `${name}.txt`), `${HEAD}Sphere 1 0 0 0 .1 .1 .1 1 1 1 # ${name}\nTrace\n`);
  const studio = await open(t, { from: folder, name: "film" });
  await studio.page.locator(".file", { hasText: "evil⟨U+202E⟩txt.gnp.txt" }).waitFor();
  await studio.page.locator(".item", { hasText: "evil⟨U+202E⟩txt.gnp" }).waitFor();
  studio.check();
  const empty = join(folder, "empty");
  mkdirSync(empty);
  const next = await open(t, { from: empty, name: "empty" });
  await next.page.locator(".item.object").first().waitFor();
  assert.ok(!existsSync(join(next.path, "scene.txt")));
  await clickRow(next.page, ".item.object");
  await next.page.locator(".viewport").focus();
  await next.page.keyboard.press("ArrowRight");
  await until(() => existsSync(join(next.path, "scene.txt")));
  next.check();
});

/** What a program says that ends by itself. */
function said(program, args) {
  return new Promise((resolve) => {
    const run = spawn(program, args);
    let text = "";
    run.stderr.on("data", (bytes) => (text += bytes));
    run.on("exit", (code) => resolve([code, text]));
  });
}

test("a script whose folder is missing is refused at once", async () => {
  const [code, text] = await said(process.env.RAYFOLD, ["studio", join(tmpdir(), "rayfold-no-such-folder/new.txt"), "--no-open"]);
  assert.equal(code, 1);
  assert.match(text, /does not exist/);
});

test("at four sizes and in both themes nothing is clipped, bars have one row, and the picture has its room", async (t) => {
  const text = `${HEAD}${FLOOR}${ball(1, "(1:-2 40:2)", 1, 0, "ball")}Frames 40\nTrace\n`;
  for (const [width, height, scheme] of [[1440, 900, "light"], [1024, 768, "dark"], [768, 1024, "light"], [390, 844, "dark"]]) {
    await t.test(`${width} x ${height}, ${scheme}`, async (t) => {
      const studio = await open(t, { text, size: [width, height], scheme });
      const { page } = studio;
      await clickRow(page, ".item", { hasText: "ball" });
      await studio.settled();
      await shot(page, `look-${width}-${scheme}`);
      const box = await page.locator(".viewport").boundingBox();
      if (width === 1440) assert.ok(box.width * box.height >= 0.5 * width * height, `${box.width} x ${box.height}`);
      if (width === 1024) assert.ok(box.width > 500, `${box.width}`);
      const overflow = await page.evaluate(() =>
        [...document.querySelectorAll("header *, main *")]
          .filter((element) => element.checkVisibility() && !element.closest("svg, .list, .menu"))
          .filter((element) => element.getBoundingClientRect().right > innerWidth + 1)
          .map((element) => element.outerHTML.slice(0, 80)),
      );
      assert.deepEqual(overflow, []);
      const rows = (selector) => page.locator(selector).evaluateAll((all) => new Set(all.filter((one) => one.checkVisibility()).map((one) => one.getBoundingClientRect()).map(({ top, height }) => Math.round((top + height / 2) / 8))).size);
      assert.equal(await rows(".transport button, .transport input, .transport output"), 1, "rows of the transport");
      if (width > 480) assert.equal(await rows(".bar button"), 1, "rows of the bar");
      const cut = await page.locator(".tile span, .sphere span, .tools button, .fold").evaluateAll((all) => all.filter((one) => one.scrollWidth > one.clientWidth + 1 && one.clientWidth > 0).map((one) => one.textContent));
      assert.deepEqual(cut, [], "labels that are cut off");
      assert.ok(await page.locator(".transport").evaluate((of) => of.scrollWidth <= of.clientWidth), "the transport fits");
      assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= width);
      assert.deepEqual(await audit(page), []);
      studio.check();
    });
  }
});

test("a sun's angles have a row each, and nothing covers the player, a menu's button or what a tour is about", async (t) => {
  const folder = await open(t, { from: join(scenes, "hello"), name: "hello", size: [1024, 768] });
  await clickRow(folder.page, ".item.light");
  const [azimuth, height] = await Promise.all(["azimuth", "height"].map((name) => folder.page.getByRole("slider", { name: `sun ${name}, slider` }).boundingBox()));
  assert.ok(height.y - azimuth.y > 20 && azimuth.width > 60, JSON.stringify([azimuth, height]));
  const free = (locator) => locator.evaluate((of) => of.contains(document.elementFromPoint(...((box) => [box.x + box.width / 2, box.y + box.height / 2])(of.getBoundingClientRect()))));
  assert.ok(await free(folder.page.getByRole("button", { name: "Play" })));
  await folder.page.getByRole("button", { name: "Keys", exact: true }).click();
  await folder.page.getByRole("button", { name: "Tour" }).click();
  await folder.page.locator(".tour").waitFor();
  assert.ok(await free(folder.page.locator(".tile", { hasText: "Sphere" })));
  folder.check();
  const phone = await open(t, { text: `${HEAD}${FLOOR}Trace\n`, size: [390, 844] });
  const button = phone.page.getByRole("button", { name: "More output" });
  await button.click();
  const [menu, above] = await Promise.all([phone.page.locator("#more-output").boundingBox(), button.boundingBox()]);
  assert.ok(menu.y >= above.y + above.height && menu.x >= 0 && menu.x + menu.width <= 390, JSON.stringify([menu, above]));
  phone.check();
});
