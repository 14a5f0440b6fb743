// Every parameter of every command and clause is changed by the mouse alone, and by the keyboard alone, and read back from
// the file. What only the table of the language says decides which those are: a new command or parameter that a hand
// cannot reach fails here.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { open, program, until } from "./stage.mjs";

const { commands, clauses } = JSON.parse(
  String(spawnSync(program, ["check", "--format", "json", "-"], { input: "Screen 4 3\nLook 0 0 9 0 0 0 40\nTrace\n" }).stdout),
).language;

const SCENE = "Screen 64 36\nLook 0 2 9  0 0.5 0  40\nIlight 1 1 1  1 -1 -1\nTrace\n";

const PIXEL = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGOoLGoFAAJtAS9RtyNWAAAAAElFTkSuQmCC";

/** What waits for the page, in milliseconds. */
const SOON = 4000;

/** The words of a line before its comment, a curve being one. */
const words = (line = "") => line.split("#")[0].match(/\([^)]*\)|"[^"]*"|[^\s,]+/g) ?? [];

/** A folder with a script, a model and a picture, and what it shows. */
async function start(t) {
  const studio = await open(t, { text: SCENE, size: [1200, 700] });
  writeFileSync(join(studio.folder, "corner.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  writeFileSync(join(studio.folder, "dot.png"), Buffer.from(PIXEL, "base64"));
  return studio;
}

/** Where a field is in the inspector: all of it, or a setting. */
const inspector = (page) => page.locator(".panel.inspector");

/** The fields for numbers, without the angles of a sun, which are its direction in other words. */
const isNumber = (name) => !/^sun (azimuth|height)$/.test(name);

/** Waits for a change that a hand has made. Returns whether it came. */
async function changes(of, before) {
  return until(async () => (await of()) !== before, SOON).then(() => true, () => false);
}

/** The mouse: it points at what it sees, turns its wheel where that is out of sight, and drags. */
function mouse(page) {
  const sight = async (found) => {
    let place = null;
    await until(async () => {
      place = await found.evaluate((element) => {
        const { left, top, width, height } = element.getBoundingClientRect();
        const [x, y] = [left + width / 2, top + height / 2];
        const seen = document.elementFromPoint(x, y);
        if (seen && (element.contains(seen) || seen.closest("button, label") === element)) return { x, y };
        let list = element.parentElement;
        while (list && !(list.scrollHeight > list.clientHeight + 1 && /auto|scroll/.test(getComputedStyle(list).overflowY))) list = list.parentElement;
        if (!list) return null;
        const room = list.getBoundingClientRect();
        return { over: [room.left + room.width / 2, room.top + room.height / 2], turn: y < room.top + room.height / 2 ? -80 : 80 };
      }).catch(() => null);
      if (place?.over) {
        await page.mouse.move(...place.over);
        await page.mouse.wheel(0, place.turn);
      }
      return place !== null && !place.over;
    });
    return place;
  };
  const click = async (found) => {
    const { x, y } = await sight(found);
    await page.mouse.click(x, y);
  };
  /** Chooses a word of a list. The list is a part of the page, because a pointer of a test finds nothing outside of it. */
  const choose = async (select, word) => {
    await click(select);
    await click(select.locator("option", { hasText: word === null ? /./ : word }).last());
  };
  return {
    name: "mouse",
    begin: () =>
      page.evaluate(() => {
        const style = new CSSStyleSheet();
        style.replaceSync("select, ::picker(select) { appearance: base-select; }");
        document.adoptedStyleSheets.push(style);
      }),
    click,
    add: async (name) => {
      const tile = page.locator(`.tile[title^='${name}:']`);
      const chip = inspector(page).locator(`.chips button[title^='${name}:']`);
      await until(async () => (await tile.count()) + (await chip.count()) > 0);
      await click((await tile.count()) > 0 ? tile : chip);
    },
    material: () => click(page.getByRole("button", { name: "New material" })),
    camera: async (name) => {
      const select = page.getByLabel("camera", { exact: true });
      if ((await select.inputValue()) === name) return;
      await click(select);
      await click(select.locator(`option[value="${name}"]`));
    },
    group: () => click(page.getByRole("button", { name: "Group", exact: true })),
    /** Presses what a page has once. */
    press: click,
    /** Changes all fields of a part of the page; returns how many numbers there are. */
    changeAll: async (within) => {
      const folded = within.locator(".field [aria-expanded=false]");
      while ((await folded.count()) > 0) await click(folded.first());
      const all = within.getByRole("spinbutton");
      let numbers = 0;
      for (let at = 0; at < (await all.count()); at += 1) {
        const field = all.nth(at);
        if (!isNumber(await field.getAttribute("aria-label"))) continue;
        numbers += 1;
        const before = await field.inputValue();
        const isChanged = () => changes(() => field.inputValue(), before);
        for (const way of [40, -40]) {
          const { x, y } = await sight(field);
          await page.mouse.move(x, y);
          await page.mouse.down();
          await page.mouse.move(x + way, y, { steps: 2 });
          await page.mouse.up();
          if (await isChanged()) break;
        }
      }
      for (const select of await within.locator(".field select").all()) {
        const now = await select.inputValue();
        const other = (await select.locator("option").allTextContents()).find((word) => word !== now);
        if (other) await choose(select, other);
      }
      return numbers;
    },
    undoAll: async (isDone) => {
      const undo = page.getByRole("button", { name: "Undo", exact: true });
      while (!(await isDone())) await click(undo);
      // What shows settings is what is shown without a selection.
      const settings = inspector(page).locator(".tools").getByRole("button", { name: "Scene settings", exact: true });
      if (await settings.count()) await click(settings);
    },
  };
}

/** The keyboard: Tab goes on, and the search adds what has no key. */
function keyboard(page) {
  const press = (key) => page.keyboard.press(key);
  /** Goes on to an element. */
  const go = async (found) => {
    for (let step = 0; step < 400; step += 1) {
      if (await found.evaluate((element) => element === document.activeElement, undefined, { timeout: SOON })) return;
      await press("Tab");
    }
    assert.fail(`Tab does not reach ${found}`);
  };
  const search = async (text, note) => {
    await press("Control+k");
    await page.getByRole("dialog", { name: "Search" }).waitFor();
    await page.keyboard.type(note ?? text);
    const options = page.getByRole("dialog", { name: "Search" }).getByRole("option");
    let meant = -1;
    await until(async () => {
      const rows = await options.evaluateAll((rows) => rows.map((row) => [...row.children].map(({ textContent }) => textContent)));
      meant = rows.findIndex(([name, of]) => name.startsWith(text) && (note === null || of === note));
      return meant >= 0;
    }).catch(() => assert.fail(`the search does not find ${text} ${note}`));
    for (let down = 0; down < meant; down += 1) await press("ArrowDown");
    await press("Enter");
  };
  const step = async (of) => {
    const before = await of();
    for (const key of ["ArrowUp", "ArrowDown"]) {
      await press(key);
      if (await changes(of, before)) return;
    }
  };
  return {
    name: "keyboard",
    begin: () => {},
    add: (name) => search("Add ", name),
    material: () => search("Add ", "Material"),
    camera: async (name) => {
      const select = page.getByLabel("camera", { exact: true });
      await go(select);
      const names = await select.locator("option").evaluateAll((all) => all.map(({ value }) => value));
      const [now, to] = [names.indexOf(await select.inputValue()), names.indexOf(name)];
      for (let at = now; at !== to; at += Math.sign(to - now)) await press(to > now ? "ArrowDown" : "ArrowUp");
      await until(async () => (await select.inputValue()) === name);
    },
    group: () => press("Control+g"),
    press: async (found) => {
      await go(found);
      await press("Enter");
    },
    changeAll: async (within) => {
      const part = await within.elementHandle();
      // From its first element to its last one, each with the focus.
      const reached = () => part.evaluate((part) => {
        const element = document.activeElement;
        if (!part.contains(element) || !element.closest(".field")) return { isIn: part.contains(element) };
        const { tagName: tag, role, ariaLabel: name, ariaExpanded: expanded, value } = element;
        return { isIn: true, tag, role, name, expanded, value };
      });
      const value = () => page.evaluate(() => document.activeElement.value);
      let [numbers, isIn] = [0, false];
      for (let at = 0; at < 400; at += 1) {
        const now = await reached();
        if (isIn && !now.isIn) return numbers;
        isIn = now.isIn;
        if (now.expanded === "false") await press("Enter");
        if (now.role === "spinbutton" && isNumber(now.name)) {
          numbers += 1;
          // A number that is left out has no next one.
          if (now.value === "") {
            await page.keyboard.type("0.7");
            await press("Enter");
          } else await step(value);
        }
        if (now.tag === "SELECT") await step(value);
        await press("Tab");
      }
      return assert.fail("Tab does not leave the inspector");
    },
    undoAll: async (isDone) => {
      while (!(await isDone())) await press("Control+z");
      // What shows settings is what is shown without a selection.
      if (await page.locator(".item[aria-selected=true]").count()) await search("Clear the selection", null);
    },
  };
}

for (const hand of [mouse, keyboard]) {
  test(`every parameter of every command is changed by the ${hand.name} alone`, async (t) => {
    assert.ok(commands.length > 20);
    const studio = await start(t);
    const { page } = studio;
    const by = hand(page);
    await by.begin();
    const line = async (command) => (await studio.saved()).split("\n").findLast((line) => words(line)[0] === command);
    for (const { name, parameters, subject } of commands) {
      if (parameters.length === 0) continue;
      const isQuoted = subject?.role === "quotes";
      // Of two settings with one name the page shows the word that one of them takes.
      const title = name === "Sky" && isQuoted ? `${name} "FILE"` : name;
      const setting = page.locator(`.inspector section[title='${title}']`);
      let within = inspector(page);
      if (subject && !isQuoted) {
        // What refers to a name is made with it: here a group, from an object.
        await by.add("Sphere");
        await page.locator(".item.object[aria-selected=true]").waitFor();
        await by.group();
        await page.locator(".item.use[aria-selected=true]").waitFor();
      } else if (name === "Camera" || name === "Look") {
        await by.camera(name);
        await by.press(within.getByRole("button", { name: "Edit", exact: true }));
      } else if ((await setting.count()) === 0) await by.add(title);
      await until(async () => (await line(name)) !== undefined);
      if ((await page.locator(".item[aria-selected=true]").count()) === 0) within = setting;
      await within.getByRole("spinbutton").or(within.locator("select, [aria-expanded=false]")).first().waitFor();
      const before = words(await line(name)).slice(subject ? 2 : 1);
      const numbers = parameters.filter(({ words }) => !words).flatMap(({ names }) => names).length;
      assert.equal(await by.changeAll(within), numbers, `${name}: the numbers on the page`);
      const count = parameters.flatMap(({ names }) => names).length;
      await until(async () => {
        const after = words(await line(name)).slice(subject ? 2 : 1);
        return after.length === count && after.every((word, at) => word !== before[at]);
      }, 10_000).catch(async () => assert.fail(`${name}: ${before} became ${await line(name)}`));
      await by.undoAll(() => studio.saved().then(() => readFileSync(studio.path, "utf8") === SCENE));
    }
    studio.check();
  });

  test(`every parameter of every clause is changed by the ${hand.name} alone`, async (t) => {
    const studio = await start(t);
    const { page } = studio;
    const by = hand(page);
    await by.begin();
    const material = async () => words((await studio.saved()).split("\n").findLast((line) => words(line)[0] === "Material"));
    for (const [at, { name, parameters, subject }] of clauses.entries()) {
      await by.material();
      await page.locator(".item.material[aria-selected=true]").waitFor();
      await until(async () => (await material()).length > 0);
      const has = async () => (await material()).includes(name);
      if (!(await has())) await by.press(page.getByRole("group", { name: "Clauses" }).getByRole("button").nth(at));
      await until(has);
      const kinds = parameters.flatMap(({ names, words }) => names.map(() => words));
      const count = kinds.length;
      const own = (all) => all.slice(all.indexOf(name) + (subject ? 2 : 1)).slice(0, count);
      const before = own(await material());
      await until(async () => (await inspector(page).locator(".field").count()) > 0);
      await by.changeAll(inspector(page));
      await until(async () => {
        const after = own(await material());
        return after.length === count && after.every((word, at) => (kinds[at]?.includes(word) ?? Number.isFinite(Number(word))) && word !== before[at]);
      }, 10_000).catch(async () => assert.fail(`${name}: ${before} became ${own(await material())}`));
      await by.undoAll(() => studio.saved().then(() => readFileSync(studio.path, "utf8") === SCENE));
    }
    studio.check();
  });
}
