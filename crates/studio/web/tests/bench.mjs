// Measures the page in headless Chromium: how soon the first picture is there, how many come a second while an object is
// dragged, how large they are, how long each takes from the pointer to the canvas, and how soon the picture is final when
// the hand rests. Writes a line of JSON for each run of a scene; `rayfold-bench studio` makes the report of them.
//
//     RAYFOLD=target/release/rayfold CHROMIUM=chromium node tests/bench.mjs RUNS SECONDS SCENES
//
// SCENES is JSON: a list of { name, script, grab, isStatic }, where `grab` is the place of an object, in shares of the
// picture. The page of a scene with `isStatic` is the static one: SITE is the folder of the site.
//
// It speaks the browser's debugging protocol itself, over a pipe and without its Network domain: that one copies every
// picture to whoever listens, and halves their rate.

import { spawn } from "node:child_process";
import { cpSync, mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

import { linked, serve } from "./host.mjs";
import { start } from "./processes.mjs";

const [runs, seconds, scenes] = process.argv.slice(2).map((word) => JSON.parse(word));

/** Width and height of the picture. */
const SIZE = [960, 540];

/** Between two moves of the pointer, in milliseconds: those of a usual mouse. */
const MOVE_MS = 8;

/** Once round the circle on which the object is dragged, in milliseconds, and the circle's radius in pixels. */
const [ROUND_MS, RADIUS] = [2000, 50];

/** The longest wait for a final picture, in milliseconds. */
const PATIENCE_MS = 5000;

/** A second, as the system counts processor time. */
const JIFFIES = 100;

/** Runs in the page before its own scripts: notes when what was asked for by the pointer is on the canvas. */
const PROBE = `(() => {
  const probe = { first: null, sizes: {}, pictures: 0, waits: [], sent: 0, asked: [], recording: false, final: null };
  window.probe = probe;
  // Each move waits for a message that was sent with it or after it, and for the picture of that.
  addEventListener("pointerrawupdate", (event) => probe.recording && probe.asked.push({ number: null, at: event.timeStamp, picture: null }), true);
  const hear = (data) => {
    if (typeof data !== "string" || !data.includes('"asked"')) return;
    const asked = Number(/"asked":(\\d+)/.exec(data)[1]);
    const picture = /"picture":\\[(\\d+)/.exec(data);
    const { settling } = probe;
    if (settling && settling.number !== null && settling.number <= asked && picture) settling.picture ??= Number(picture[1]);
    for (const drag of probe.asked) if (drag.picture === null && drag.number !== null && drag.number <= asked && picture) drag.picture = Number(picture[1]);
  };
  const send = (text) => {
    if (typeof text !== "string") return;
    probe.sent += 1;
    if (probe.settling && probe.settling.from !== null && /"ask":"(drag|release)"/.test(text)) probe.settling.number ??= probe.sent;
    if (text.startsWith('{"ask":"drag"')) for (const drag of probe.asked) drag.number ??= probe.sent;
  };
  // The session is behind a socket, or in a worker of the static page.
  for (const [name, method] of [["WebSocket", "send"], ["Worker", "postMessage"]]) {
    window[name] = class extends window[name] {
      constructor(...args) {
        super(...args);
        this.addEventListener("message", ({ data }) => hear(data));
      }
      [method](...args) {
        send(args[0]);
        super[method](...args);
      }
    };
  }
  // Notes how long the final picture takes after the next of these pointer events.
  probe.settles = (...kinds) => {
    probe.final = null;
    const settling = (probe.settling = { from: null, number: null, picture: null });
    for (const kind of kinds) addEventListener(kind, (event) => (settling.from ??= event.timeStamp), { capture: true, once: true });
  };
  addEventListener("picture", ({ detail, target }) => {
    const now = performance.now();
    probe.first ??= now;
    const { settling } = probe;
    if (settling && settling.picture !== null && detail >= settling.picture && target.dataset.final === "true") probe.final ??= now - settling.from;
    if (!probe.recording) return;
    probe.pictures += 1;
    const size = target.width + "x" + target.height;
    probe.sizes[size] = (probe.sizes[size] ?? 0) + 1;
    probe.asked = probe.asked.filter((drag) => {
      if (drag.picture === null || drag.picture > detail) return true;
      probe.waits.push(now - drag.at);
      return false;
    });
  }, true);
})()`;

const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** A browser, and a way to ask it. */
function browse(folder) {
  const flags = ["--headless=new", "--no-sandbox", "--remote-debugging-pipe", "--no-first-run", `--user-data-dir=${folder}`, "about:blank"];
  const browser = spawn(process.env.CHROMIUM, flags, { stdio: ["ignore", "ignore", "ignore", "pipe", "pipe"] });
  const [, , , to, from] = browser.stdio;
  const answers = new Map();
  let [next, held] = [0, Buffer.alloc(0)];
  from.on("data", (bytes) => {
    held = Buffer.concat([held, bytes]);
    for (let end = held.indexOf(0); end >= 0; end = held.indexOf(0)) {
      const message = JSON.parse(held.subarray(0, end).toString());
      held = held.subarray(end + 1);
      const answer = answers.get(message.id);
      answers.delete(message.id);
      if (message.error) answer?.reject(new Error(JSON.stringify(message.error)));
      else answer?.resolve(message.result);
    }
  });
  const ended = new Promise((resolve) => browser.on("exit", resolve));
  const ask = (method, params = {}, sessionId = undefined) =>
    new Promise((resolve, reject) => {
      next += 1;
      answers.set(next, { resolve, reject });
      to.write(`${JSON.stringify({ id: next, method, params, sessionId })}\0`);
    });
  return { ask, ended, pid: browser.pid };
}

/** Jiffies that all processors worked, and that there were. */
function processors() {
  const [user, nice, system, idle, iowait, irq, softirq, steal] = readFileSync("/proc/stat", "utf8").split("\n")[0].split(/\s+/).slice(1).map(Number);
  const busy = user + nice + system + irq + softirq + steal;
  return { busy, all: busy + idle + iowait };
}

/** Jiffies that these processes and their children worked. */
function ours(roots) {
  const of = new Map();
  for (const pid of readdirSync("/proc").filter((name) => /^\d+$/.test(name))) {
    try {
      const stat = readFileSync(`/proc/${pid}/stat`, "utf8");
      const fields = stat.slice(stat.lastIndexOf(")") + 2).split(" ");
      of.set(Number(pid), { parent: Number(fields[1]), time: Number(fields[11]) + Number(fields[12]) });
    } catch {
      // It has ended meanwhile.
    }
  }
  const isOurs = (pid) => roots.includes(pid) || (of.has(pid) && isOurs(of.get(pid).parent));
  return [...of].filter(([pid]) => isOurs(pid)).reduce((sum, [, { time }]) => sum + time, 0);
}

/** A studio that has opened a script: its address, its processes, and how it is stopped. */
async function opened(script, folder, isStatic) {
  if (isStatic) {
    const { address, close } = await serve();
    const url = `${address}studio.html${linked("scene", [["scene.txt", readFileSync(script)]])}`;
    return { url, pids: [], stop: close };
  }
  const path = join(folder, "scene.txt");
  cpSync(script, path);
  const { server, said, ended } = start(process.env.RAYFOLD, ["studio", path, "--no-open"]);
  const stop = () => {
    server.kill("SIGINT");
    return ended;
  };
  return { url: (await said((text) => text.includes("\n"))).trim(), pids: [server.pid], stop };
}

async function measure(run, { name, script, grab, isStatic }) {
  const folder = mkdtempSync(join(tmpdir(), "rayfold-bench-"));
  const studio = await opened(script, folder, isStatic);
  const browser = browse(join(folder, "browser"));
  try {
    const { targetInfos } = await browser.ask("Target.getTargets");
    const { targetId } = targetInfos.find(({ type }) => type === "page");
    const { sessionId } = await browser.ask("Target.attachToTarget", { targetId, flatten: true });
    const page = (method, params) => browser.ask(method, params, sessionId);
    const evaluate = async (expression) => {
      const { result, exceptionDetails } = await page("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true });
      if (exceptionDetails) throw new Error(JSON.stringify(exceptionDetails));
      return result.value;
    };
    await page("Page.enable");
    await page("Page.addScriptToEvaluateOnNewDocument", { source: PROBE });
    const room = (width, height) => page("Emulation.setDeviceMetricsOverride", { width, height, deviceScaleFactor: 1, mobile: false });
    await room(1600, 700);
    const open = async () => {
      await page("Page.navigate", { url: studio.url });
      for (let round = 0; ; round += 1) {
        await wait(50);
        if ((await evaluate("window.probe?.first ?? null")) !== null) return;
        if (round > 600) throw new Error("no picture came");
      }
    };
    await open();
    const cold = await evaluate("probe.first");
    const box = (of) => evaluate(`(() => { const b = document.querySelector("${of}").getBoundingClientRect(); return [b.left, b.top, b.width, b.height]; })()`);
    const [, , width, height] = await box(".viewport");
    await room(1600 + SIZE[0] - width, 700 + SIZE[1] - height);
    // Opened anew in this size, by a browser that has started.
    await page("Page.navigate", { url: "about:blank" });
    await open();
    const first = await evaluate("probe.first");
    // The small pictures of materials and scenes are drawn once.
    for (let round = 0; round < 400 && !(await evaluate("[...document.images].every(({ complete, offsetParent }) => complete || offsetParent === null)")); round += 1) await wait(50);
    await wait(800);
    const [left, top] = await box("canvas");
    const [x, y] = [left + grab[0] * SIZE[0], top + grab[1] * SIZE[1]];
    const mouse = (type, x, y, buttons) => page("Input.dispatchMouseEvent", { type, x, y, button: buttons || type === "mouseReleased" ? "left" : "none", buttons, clickCount: 1 });
    await mouse("mouseMoved", x, y, 0);
    await mouse("mousePressed", x, y, 1);
    const begin = performance.now();
    let [from, before] = [null, null];
    const pids = [...studio.pids, browser.pid, process.pid];
    const moves = [];
    // The first second is not counted: caches fill, and the browser compiles.
    for (let now = 0; now < 1000 * (1 + seconds); now = performance.now() - begin) {
      if (from === null && now >= 1000) {
        await evaluate("probe.recording = true");
        [from, before] = [performance.now(), { ...processors(), ours: ours(pids) }];
      }
      const turn = (2 * Math.PI * now) / ROUND_MS;
      moves.push(mouse("mouseMoved", x + RADIUS * Math.sin(turn), y - RADIUS * (1 - Math.cos(turn)), 1));
      await wait(MOVE_MS);
    }
    await evaluate("probe.recording = false");
    const took = (performance.now() - from) / 1000;
    const [total, own] = [processors(), ours(pids)];
    await Promise.all(moves);
    // The hand rests, with the button down; then it lets go while it moves.
    const settled = async (kinds, act) => {
      await evaluate(`probe.settles(${kinds})`);
      await act();
      for (let waited = 0; waited < PATIENCE_MS; waited += 20) {
        await wait(20);
        const took = await evaluate("probe.final");
        if (took !== null) return took;
      }
      return null;
    };
    const rested = await settled('"pointermove", "pointerrawupdate"', () => mouse("mouseMoved", x + RADIUS / 2, y, 1));
    await mouse("mouseMoved", x, y + 10, 1);
    await wait(2 * MOVE_MS);
    const released = await settled('"pointerup"', () => mouse("mouseReleased", x, y + 10, 0));
    const selected = await evaluate(`document.querySelectorAll("[aria-selected=true]").length`);
    if (selected === 0) throw new Error("no object is where the pointer went down");
    const probe = await evaluate("JSON.stringify({ sizes: probe.sizes, pictures: probe.pictures, waits: probe.waits })");
    const others = (total.busy - before.busy - (own - before.ours)) / (total.all - before.all);
    const processorMs = (1000 * (own - before.ours)) / JIFFIES;
    console.log(JSON.stringify({ scene: name, run, cold, first, rested, released, seconds: took, others, processorMs, ...JSON.parse(probe) }));
  } finally {
    await browser.ask("Browser.close").catch(() => {});
    await browser.ended;
    await studio.stop();
    rmSync(folder, { recursive: true, force: true });
  }
}

for (let run = 1; run <= runs; run += 1) for (const scene of scenes) await measure(run, scene);
