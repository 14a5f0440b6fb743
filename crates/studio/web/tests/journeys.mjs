// Every parameter of every command and clause is changed by the mouse alone, and by the keyboard alone, and read back from
// the script. The table of the language decides which those are: a new parameter that a hand cannot reach fails here. Each run
// takes half of the commands and clauses.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";

import { half, open, program, until } from "./stage.mjs";

const { commands, clauses } = JSON.parse(
  String(spawnSync(program, ["check", "--format", "json", "-"], { input: "Screen 4 3\nLook 0 0 9 0 0 0 40\nTrace\n" }).stdout),
).language;

const SCENE = "Screen 64 36\nLook 0 2 9  0 0.5 0  40\nIlight 1 1 1  1 -1 -1\nTrace\n";

const PIXEL = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGOoLGoFAAJtAS9RtyNWAAAAAElFTkSuQmCC";

/** The milliseconds after which what a hand does has had no effect. */
const SOON = 3000;

/** What a field of the inspector is used by, without the angles of a sun, which are its direction in other words. */
const CONTROL = ".field :is([role=spinbutton]:not([aria-label^='sun ']), select)";

/** The words of a line before its comment, a curve being one. */
const words = (line = "") => line.split("#")[0].match(/\([^)]*\)|"[^"]*"|[^\s,]+/g) ?? [];

/** The numbers and words of a command or clause behind its name. */
const countOf = ({ parameters, subject, ends_with: other }) =>
  parameters.flatMap(({ names }) => names).length + (isChosen(subject) ? 1 : 0) + (other ? 1 : 0);

/** Whether a name before the numbers is chosen from those that there are. */
const isChosen = (subject) => subject?.role === "refers" || subject?.of === "file";

/** Whether lines of a command are in the list of the scene. */
const isListed = ({ name, material_instead_from: surface }) => surface !== undefined || ["Look", "Camera", "Use", "Ilight", "Plight"].includes(name);

/** The number of controls, once it stays the same: those of an earlier clause go when the program has answered. */
async function settled(controls) {
  let last = -1;
  await until(async () => {
    const before = last;
    last = await controls.count();
    if (last !== before) await new Promise((resolve) => setTimeout(resolve, 200));
    return last === before;
  });
  return last;
}

/** A folder with a script, models and pictures, and the page of the script. */
async function start(t, hand) {
  const studio = await open(t, { text: SCENE, size: [940, 700] });
  for (const name of ["a.obj", "b.obj"]) writeFileSync(join(studio.folder, name), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  for (const name of ["a.png", "b.png"]) writeFileSync(join(studio.folder, name), Buffer.from(PIXEL, "base64"));
  const { page } = studio;
  const inspector = page.locator(".panel.inspector");
  const by = hand(page, inspector);
  await by.begin();
  /** The script, as the program has it. */
  const script = async () => (await fetch(`${studio.address}script.txt?0`)).text();
  const lines = async () => (await script()).split("\n");
  /** The index of the last line of a command. Of two with one name, one has a name in quotes. */
  const find = async ({ name, subject }) =>
    (await lines()).findLastIndex((line) => words(line)[0] === name && (subject?.role === "quotes") === /^"/.test(words(line)[1]));
  /** Waits until the script is another one and stays so, as a drag has several steps, and returns it; `null` if there is none. */
  const changed = async (before) => {
    let last = before;
    for (const end = Date.now() + SOON; Date.now() < end; await new Promise((resolve) => setTimeout(resolve, 40))) {
      const now = await script();
      if (now !== before && now === last) return now;
      last = now;
    }
    return null;
  };
  /**
   * Uses controls of a part of the page, the last one first, because a word may take away what follows it. Each has to change
   * the line. Returns the positions of the words that have changed.
   */
  const useAll = async (within, at, count = Infinity) => {
    const touched = new Set();
    let used = 0;
    let before = await script();
    for await (const use of by.controls(within)) {
      await use(true);
      let now = await changed(before);
      if (now === null) {
        await use(false);
        now = await changed(before);
      }
      const old = before.split("\n")[at];
      assert.ok(now, `control ${used + 1} from the end does not change ${old}`);
      words(now.split("\n")[at]).forEach((word, place) => word !== words(old)[place] && touched.add(place));
      before = now;
      used += 1;
      if (used === count) break;
    }
    return { touched, used };
  };
  return { ...studio, by, inspector, lines, find, useAll };
}

/** The mouse: it points at what it sees, turns its wheel where that is out of sight, and drags. */
function mouse(page, inspector) {
  const sight = async (found) => {
    let place = null;
    await until(async () => {
      place = await found.evaluate(async (element) => {
        const { left, top, width, height } = element.getBoundingClientRect();
        const [x, y] = [left + width / 2, top + height / 2];
        // What moves is not pressed: a press would meet what comes to its place.
        await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
        const later = element.getBoundingClientRect();
        if (later.left !== left || later.top !== top) return null;
        const seen = document.elementFromPoint(x, y);
        if (seen && (element.contains(seen) || seen.closest("button, label") === element)) return { x, y };
        let list = element.parentElement;
        while (list && !(list.scrollHeight > list.clientHeight + 1 && /auto|scroll/.test(getComputedStyle(list).overflowY))) list = list.parentElement;
        if (!list) return null;
        const room = list.getBoundingClientRect();
        return { over: [room.left + room.width / 2, room.top + room.height / 2], turn: y - room.top - room.height / 2 };
      }).catch(() => null);
      if (place?.over) {
        await page.mouse.move(...place.over);
        await page.mouse.wheel(0, place.turn);
        // A turn of the wheel takes effect later.
        await page.waitForTimeout(50);
      }
      return place !== null && !place.over;
    });
    return place;
  };
  const click = async (found) => {
    const { x, y } = await sight(found);
    await page.mouse.click(x, y);
  };
  /** Chooses another word of a list: the next one, or the one before. */
  const choose = async (select, step) => {
    const [at, count] = await select.evaluate(({ selectedIndex, options }) => [selectedIndex, options.length]);
    await click(select);
    await click(select.locator("option").nth((Math.max(at, 0) + step + count) % count));
  };
  const drag = async (field, by) => {
    const { x, y } = await sight(field);
    await page.mouse.move(x, y);
    await page.mouse.down();
    await page.mouse.move(x + by, y, { steps: 2 });
    await page.mouse.up();
  };
  return {
    name: "mouse",
    /** The lists of words are parts of the page, because a pointer of a test finds nothing outside of it. */
    begin: () =>
      page.evaluate(() => {
        const style = new CSSStyleSheet();
        style.replaceSync("select, ::picker(select) { appearance: base-select; }");
        document.adoptedStyleSheets.push(style);
      }),
    add: async (name) => {
      const tile = page.locator(`.tile[title^='${name}:']`);
      const chip = inspector.locator(`.chips button[title^='${name}:']`);
      await until(async () => (await tile.count()) + (await chip.count()) > 0);
      await click((await tile.count()) > 0 ? tile : chip);
    },
    material: () => click(page.getByRole("button", { name: "New material" })),
    camera: async (name) => {
      const select = page.getByLabel("camera", { exact: true });
      await click(select);
      await click(select.locator(`option[value="${name}"]`));
    },
    group: () => click(page.getByRole("button", { name: "Group", exact: true })),
    /** Presses what a page has once. */
    press: click,
    /** Shows the settings of the scene, which are shown without a selection. */
    settings: async () => {
      const button = inspector.locator(".tools").getByRole("button", { name: "Scene settings", exact: true });
      if (await button.count()) await click(button);
    },
    reach: async (line) => {
      const row = page.locator(`#line-${line}`);
      await until(async () => {
        if (await row.count()) return true;
        // Only rows near those in sight are made.
        const first = await page.locator(".item[id^=line-]").first().evaluate(({ id }) => Number(id.replace("line-", "")));
        const { x, y, width, height } = await page.getByRole("listbox").boundingBox();
        await page.mouse.move(x + width / 2, y + height / 2);
        await page.mouse.wheel(0, first > line ? -100 : 100);
        return false;
      });
      await click(row);
    },
    controls: async function* (within) {
      const folded = within.locator(".field [aria-expanded=false]");
      while ((await folded.count()) > 0) await click(folded.first());
      const all = within.locator(CONTROL);
      for (let at = (await settled(all)) - 1; at >= 0; at -= 1) {
        const control = all.nth(at);
        const isList = (await control.evaluate(({ tagName }) => tagName)) === "SELECT";
        yield (up) => (isList ? choose(control, up ? 1 : -1) : drag(control, up ? 12 : -12));
      }
    },
  };
}

/** The keyboard: Tab goes on, and the search adds what has no key. */
function keyboard(page, inspector) {
  const press = (key) => page.keyboard.press(key);
  /** Goes to what a page has, by Tab. Most of the way is counted first, so that not each step is looked at. */
  const go = async (found) => {
    const element = await found.elementHandle({ timeout: SOON });
    const way = await element.evaluate((element) => {
      const all = [...document.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex]")].filter(
        (one) => one.tabIndex >= 0 && !one.disabled && one.checkVisibility(),
      );
      return all.indexOf(element) - all.indexOf(document.activeElement);
    });
    const key = way < 0 ? "Shift+Tab" : "Tab";
    for (let step = 3; step < Math.abs(way); step += 1) await press(key);
    for (let step = 0; step < 400; step += 1) {
      if (await element.evaluate((element) => element === document.activeElement)) return;
      await press(key);
    }
    assert.fail(`Tab does not reach ${found}`);
  };
  const search = async (text, note) => {
    await press("Control+k");
    const dialog = page.getByRole("dialog", { name: "Search" });
    await dialog.waitFor();
    await page.keyboard.type(note ?? text);
    // What is found changes while the page follows the typing: each step looks anew.
    await until(async () => {
      const rows = await dialog.getByRole("option").evaluateAll((rows) =>
        rows.map((row) => ({ texts: [...row.children].map(({ textContent }) => textContent), isChosen: row.ariaSelected === "true" })),
      );
      const meant = rows.findIndex(({ texts: [name, of] }) => name.startsWith(text) && (note === undefined || of === note));
      const isChosen = meant >= 0 && rows[meant].isChosen;
      if (meant >= 0 && !isChosen) await press(rows.findIndex((row) => row.isChosen) < meant ? "ArrowDown" : "ArrowUp");
      return isChosen && (await dialog.getByRole("combobox").inputValue()) === (note ?? text);
    }).catch(() => assert.fail(`the search does not find ${text} ${note}`));
    await press("Enter");
    await dialog.waitFor({ state: "detached" });
  };
  return {
    name: "keyboard",
    /** Collapses the panel of materials, which has many buttons between the list and the inspector. */
    begin: async () => {
      await go(page.getByRole("button", { name: "Materials", exact: true }));
      await press("Enter");
    },
    add: (name) => search("Add ", name),
    material: () => search("Add ", "Material"),
    camera: async (name) => {
      const select = page.getByLabel("camera", { exact: true });
      await go(select);
      const [now, to] = await select.evaluate(({ selectedIndex, options }, name) => [selectedIndex, [...options].findIndex(({ value }) => value === name)], name);
      for (let at = now; at !== to; at += Math.sign(to - now)) {
        await press(to > now ? "ArrowDown" : "ArrowUp");
        // The list stays where the camera is until the studio has made it another one.
        const next = at + Math.sign(to - now);
        await until(() => select.evaluate(({ selectedIndex }, next) => selectedIndex === next, next), SOON);
      }
    },
    group: () => press("Control+g"),
    press: async (found) => {
      await go(found);
      await press("Enter");
    },
    settings: async () => {
      const selected = page.locator(".item[aria-selected=true]");
      // What was added is selected a moment later.
      await until(async () => {
        if ((await settled(selected)) > 0) await search("Clear the selection");
        return (await settled(selected)) === 0;
      });
    },
    reach: async (line) => {
      await go(page.getByRole("listbox"));
      await press("End");
      const isReached = () => page.locator(`#line-${line}[aria-selected=true]`).count();
      for (let up = 0; !(await isReached()); up += 1) {
        assert.ok(up < 100, `the arrows do not reach line ${line}`);
        await press("ArrowUp");
      }
    },
    controls: async function* (within) {
      const folded = within.locator(".field [aria-expanded=false]");
      while ((await folded.count()) > 0) {
        await go(folded.first());
        await press("Enter");
      }
      const part = await within.elementHandle();
      const reached = () =>
        part.evaluate((part, control) => {
          const element = document.activeElement;
          const { tagName, value } = element;
          return { isIn: part.contains(element), isControl: element.matches(control), tagName, value };
        }, CONTROL);
      await settled(within.locator(CONTROL));
      await go(within.locator(CONTROL).last());
      for (;;) {
        const now = await reached();
        if (!now.isIn) return;
        if (now.isControl) {
          yield async (up) => {
            // A number that is left out has no next one.
            if (now.value !== "" || now.tagName === "SELECT") return press(up ? "ArrowUp" : "ArrowDown");
            await page.keyboard.type(up ? "0.7" : "9");
            await press("Enter");
          };
        }
        await press("Shift+Tab");
      }
    },
  };
}

for (const hand of [mouse, keyboard]) {
  test(`every parameter of a command is changed by one hand alone: the ${hand.name}`, async (t) => {
    const studio = await start(t, hand);
    const { page, by, inspector, lines, find, useAll } = studio;
    const taking = commands.filter(({ parameters }) => parameters.length > 0);
    assert.ok(taking.length > 20);
    // Objects before settings, which make the picture slower to draw; frames last, with which each number gets a key.
    const firstObject = taking.findIndex(({ material_instead_from: surface }) => surface);
    const order = [...taking.slice(firstObject), ...taking.slice(0, firstObject)];
    order.sort((a, b) => (a.name === "Frames") - (b.name === "Frames"));
    for (const entry of half(t, order)) {
      const { name, subject } = entry;
      // Of two settings with one name the page shows the word that one of them takes.
      const title = name === "Sky" && subject ? `${name} "FILE"` : name;
      const setting = inspector.locator(`section[title='${title}']`);
      const selected = page.locator(".item[aria-selected=true]");
      if (name === "Use") {
        // What refers to a group is made with it. There are two.
        for (const used of [1, 2]) {
          await by.add("Sphere");
          await page.locator(".item.object[aria-selected=true]").waitFor();
          await by.group();
          await until(async () => (await lines()).filter((line) => line.startsWith("Use")).length === used);
        }
      } else if (name === "Camera" || name === "Look") {
        await by.settings();
        if ((await find(entry)) < 0) await by.camera(name);
        await until(async () => (await find(entry)) >= 0);
        await by.press(inspector.getByRole("button", { name: "Edit", exact: true }).first());
        await page.locator(".item.camera[aria-selected=true]").waitFor();
      } else {
        if (!isListed(entry)) await by.settings();
        if ((await find(entry)) < 0) await by.add(title);
      }
      await until(async () => (await find(entry)) >= 0);
      const at = await find(entry);
      let within = setting;
      if (isListed(entry)) {
        // The line is reached from the list.
        await by.settings();
        await by.reach(at);
        await until(async () => (await selected.getAttribute("id").catch(() => "")) === `line-${at}`);
        within = inspector;
        await inspector.locator(".subject .note", { hasText: name }).waitFor();
      }
      await within.locator(".field").first().waitFor();
      const { touched, used } = await useAll(within, at);
      const count = countOf(entry);
      const line = (await lines())[at];
      assert.equal(used, count, `${name}: controls on the page`);
      const first = 1 + (subject && !isChosen(subject) ? 1 : 0);
      assert.deepEqual([...touched].sort((a, b) => a - b), Array.from({ length: count }, (_, at) => first + at), `${name}: ${line}`);
      assert.equal(words(line).length, first + count, line);
    }
    assert.equal(await studio.saved(), (await lines()).join("\n"));
    studio.check();
  });

  test(`every parameter of a clause is changed by one hand alone: the ${hand.name}`, async (t) => {
    const studio = await start(t, hand);
    const { page, by, inspector, lines, find, useAll } = studio;
    // A new material comes before the others, so that the first one can name two.
    for (const made of [1, 2, 3]) {
      await by.material();
      await until(async () => (await lines()).filter((line) => line.startsWith("Material")).length === made);
      await by.settings();
    }
    const at = await find({ name: "Material" });
    await by.reach(at);
    const material = async () => words((await lines())[at]);
    const chips = inspector.getByRole("group", { name: "Clauses" }).getByRole("button");
    for (const [chip, entry] of half(t, [...clauses.entries()])) {
      const { name } = entry;
      const has = async () => (await material()).includes(name);
      const isBlank = name === "diffuse";
      if (!isBlank) await by.press(chips.nth(chip));
      await until(has);
      await chips.nth(chip).and(page.locator("[aria-pressed=true]")).waitFor();
      const count = countOf(entry);
      const first = (await material()).indexOf(name) + 1;
      if (count > 0) {
        await inspector.locator(CONTROL).or(inspector.locator(".field [aria-expanded=false]")).first().waitFor();
        const { touched, used } = await useAll(inspector, at, count);
        assert.equal(used, count, `${name}: controls on the page`);
        const expected = Array.from({ length: count }, (_, at) => first + at);
        assert.deepEqual([...touched].sort((a, b) => a - b), expected, `${name}: ${(await lines())[at]}`);
      }
      if (isBlank) continue;
      await by.press(chips.nth(chip));
      await until(async () => !(await has()));
      await chips.nth(chip).and(page.locator("[aria-pressed=false]")).waitFor();
    }
    assert.equal(await studio.saved(), (await lines()).join("\n"));
    studio.check();
  });
}
