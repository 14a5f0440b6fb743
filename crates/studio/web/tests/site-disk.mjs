// Work on a folder of the disk in the page without a program, as `site.mjs`. The folder that a user would choose is one of the
// browser's own storage: a handle of the same kind, without the browser's dialogs.

import assert from "node:assert/strict";
import { after, before, test } from "node:test";

import { chromium } from "playwright-core";

import { film, serve } from "./host.mjs";

const { CHROMIUM: executablePath } = process.env;

let browser, host;
before(async () => {
  browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
  host = await serve();
});
after(async () => {
  await browser?.close();
  host?.close();
});

const script = film.replace("Frames 6\n", "");

/** A page whose folder is chosen without a dialog, with what stands in for the system: `disk` reads and writes as other programs do. */
async function open(t, files) {
  const context = await browser.newContext({ viewport: { width: 1400, height: 900 } });
  t.after(() => context.close());
  const page = await context.newPage();
  page.setDefaultTimeout(30_000);
  const faults = [];
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  await context.addInitScript(() => {
    const folder = async () => (await navigator.storage.getDirectory()).getDirectoryHandle("film of the disk", { create: true });
    globalThis.showDirectoryPicker = async () => {
      if (sessionStorage.getItem("given up")) throw new DOMException("The user aborted a request.", "AbortError");
      return folder();
    };
    // What the user has answered, which outlives a page. A handle of the browser's own storage is always granted.
    const asked = () => localStorage.getItem("permission") ?? "granted";
    FileSystemHandle.prototype.queryPermission = async () => asked();
    FileSystemHandle.prototype.requestPermission = async () => {
      if (asked() === "prompt") localStorage.setItem("permission", localStorage.getItem("answer"));
      return asked();
    };
    globalThis.disk = {
      async read(name) {
        return (await (await (await folder()).getFileHandle(name)).getFile()).text();
      },
      async write(name, text) {
        const stream = await (await (await folder()).getFileHandle(name, { create: true })).createWritable();
        await stream.write(text);
        await stream.close();
      },
      async remove(name) {
        await (await folder()).removeEntry(name);
      },
      async names() {
        const names = [];
        for await (const name of (await folder()).keys()) names.push(name);
        return names.sort();
      },
    };
  });
  await page.goto(`${host.address}studio.html`);
  for (const [name, text] of files) await page.evaluate(([name, text]) => disk.write(name, text), [name, text]);
  const drawn = () => page.waitForFunction(() => document.querySelector("canvas")?.dataset.final === "true");
  await drawn();
  return { page, drawn, check: () => assert.deepEqual(faults, []) };
}

/** Chooses the folder, and waits for its page. */
async function choose(page) {
  await page.getByRole("button", { name: "File", exact: true }).click();
  await page.getByRole("button", { name: "Open a folder" }).click();
}

const holds = (page, name, part) => page.waitForFunction(([name, part]) => disk.read(name).then((text) => text.includes(part), () => false), [name, part]);

test("a folder of the disk is opened, and what is edited is in its files", async (t) => {
  const { page, drawn, check } = await open(t, [["a.txt", script], ["b.txt", script], ["notes.md", "mine"]]);
  await choose(page);
  await page.waitForURL(/#folder$/);
  await page.locator("output", { hasText: "frame 1 of 2" }).waitFor();
  await drawn();
  await page.locator(".cm-content").click();
  await page.keyboard.press("Control+Home");
  await page.keyboard.type("# edited\n");
  await holds(page, "a.txt", "# edited\nScreen");
  assert.equal(await page.evaluate(() => disk.read("b.txt")), script);
  assert.deepEqual(await page.evaluate(() => disk.names()), ["a.txt", "b.txt", "notes.md"]);
  check();
});

test("what other programs write to a folder is shown", async (t) => {
  const { page, drawn, check } = await open(t, [["a.txt", script], ["b.txt", script]]);
  await choose(page);
  await page.locator("output", { hasText: "frame 1 of 2" }).waitFor();
  await page.evaluate(([name, text]) => disk.write(name, text), ["a.txt", `# of another program\n${script}`]);
  await page.locator(".cm-content", { hasText: "of another program" }).waitFor();
  await drawn();
  await page.evaluate(([name, text]) => disk.write(name, text), ["c.txt", script]);
  await page.getByText("c.txt is new in the folder. Load the page again to see it.").waitFor();
  await page.evaluate(() => disk.remove("b.txt"));
  await page.getByText("b.txt was deleted from the folder.").waitFor();
  await page.reload();
  await page.locator("output", { hasText: "frame 1 of 2" }).waitFor();
  assert.deepEqual(await page.evaluate(() => disk.names()), ["a.txt", "c.txt"]);
  check();
});

test("what another program writes while the page is edited is kept, and undo restores the edit", async (t) => {
  const { page, check } = await open(t, [["a.txt", script], ["b.txt", script]]);
  await choose(page);
  await page.locator("output", { hasText: "frame 1 of 2" }).waitFor();
  await page.locator(".cm-content").click();
  await page.keyboard.press("Control+Home");
  // Both between two looks: the page writes half a second after the last change.
  await page.evaluate(() => {
    globalThis.watched = setInterval(() => void disk.write("a.txt", `# theirs\nScreen 160 120\nTrace\n`), 50);
  });
  await page.keyboard.type("# mine\n");
  await page.waitForTimeout(2000);
  await page.evaluate(() => clearInterval(watched));
  await page.locator(".cm-content", { hasText: "# theirs" }).waitFor();
  await holds(page, "a.txt", "# theirs");
  await page.locator(".cm-content").click();
  for (let step = 0; step < 3 && !(await page.locator(".cm-content", { hasText: "# mine" }).count()); step += 1) {
    await page.keyboard.press("Control+z");
    await page.waitForTimeout(500);
  }
  await page.locator(".cm-content", { hasText: "# mine" }).waitFor();
  check();
});

test("a script is added to a folder, and the folder is open again after a reload and in the dialog of runs", async (t) => {
  const { page, check } = await open(t, [["a.txt", script], ["b.txt", script]]);
  await choose(page);
  await page.locator("output", { hasText: "frame 1 of 2" }).waitFor();
  await page.getByRole("button", { name: "File", exact: true }).click();
  await page.getByLabel("New script of the folder:").fill("z");
  await page.getByRole("button", { name: "Save as", exact: true }).click();
  await holds(page, "z.txt", "Sphere");
  await page.reload();
  await page.locator("output", { hasText: "frame 1 of 3" }).waitFor();
  await page.evaluate(() => (location.hash = "#run=film"));
  await page.reload();
  await page.locator("output", { hasText: "frame 1 of 3" }).waitFor();
  check();
});

test("a choice that is given up changes nothing", async (t) => {
  const { page, check } = await open(t, []);
  await page.evaluate(() => sessionStorage.setItem("given up", "yes"));
  const before = page.url();
  await choose(page);
  await page.getByRole("button", { name: "Open a folder" }).waitFor();
  assert.equal(page.url(), before);
  check();
});

test("a folder that the browser asks about again is opened once the user agrees", async (t) => {
  const { page, check } = await open(t, [["a.txt", script], ["b.txt", script]]);
  await choose(page);
  await page.waitForURL(/#folder$/);
  await page.locator("output", { hasText: "frame 1 of 2" }).waitFor();
  await page.evaluate(() => {
    localStorage.setItem("permission", "prompt");
    localStorage.setItem("answer", "denied");
  });
  await page.reload();
  await page.getByText("The browser asks again before the folder film of the disk is used").waitFor();
  await page.waitForURL(/#project=/);
  await page.getByRole("button", { name: "File", exact: true }).click();
  const again = page.getByRole("button", { name: "Open the folder film of the disk again" });
  await again.click();
  await page.getByText("the browser may not use the folder film of the disk").first().waitFor();
  await page.evaluate(() => {
    localStorage.setItem("permission", "prompt");
    localStorage.setItem("answer", "granted");
  });
  await again.click();
  await page.waitForURL(/#folder$/);
  await page.locator("output", { hasText: "frame 1 of 2" }).waitFor();
  check();
});

test("what cannot be written is said, and written as soon as it can be", async (t) => {
  const { page, check } = await open(t, [["a.txt", script], ["b.txt", script]]);
  await choose(page);
  await page.locator("output", { hasText: "frame 1 of 2" }).waitFor();
  await page.evaluate(async () => (await navigator.storage.getDirectory()).removeEntry("film of the disk", { recursive: true }));
  await page.locator(".cm-content").click();
  await page.keyboard.press("Control+Home");
  await page.keyboard.type("# late\n");
  await page.getByText(/a.txt cannot be written: .* It is tried again/).waitFor();
  await page.evaluate(() => disk.write("other.md", "the folder is there again"));
  await holds(page, "a.txt", "# late\nScreen");
  check();
});
