// How fast the viewport follows a drag: `node --experimental-websocket tests/pace.mjs SCRIPT`, with RAYFOLD and CHROMIUM.
//
// Speaks to the browser by the DevTools protocol alone, without its network domain: whatever mirrors the pictures that
// come over the WebSocket halves their rate. A measurement, not a test.

import { spawn } from "node:child_process";
import { cpSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const SECONDS = 10;

const folder = mkdtempSync(join(tmpdir(), "rayfold-pace-"));
const path = join(folder, "scene.txt");
cpSync(process.argv[2], path);

const line = (child, stream, pattern) =>
  new Promise((resolve, reject) => {
    let said = "";
    child[stream].on("data", (bytes) => {
      said += bytes;
      const found = said.match(pattern);
      if (found) resolve(found[1]);
    });
    child.on("exit", () => reject(new Error(said)));
  });

const server = spawn(process.env.RAYFOLD, ["studio", path, "--no-open"], { stdio: ["ignore", "pipe", "inherit"] });
const address = await line(server, "stdout", /(http\S+)\n/);
const browser = spawn(process.env.CHROMIUM, [
  "--headless",
  "--no-sandbox",
  "--remote-debugging-port=0",
  `--user-data-dir=${join(folder, "profile")}`,
  "--window-size=1640,700",
  "about:blank",
]);
const devtools = await line(browser, "stderr", /DevTools listening on (ws:\S+)/);

const socket = new WebSocket(devtools);
await new Promise((resolve) => (socket.onopen = resolve));
let number = 0;
const waiting = new Map();
socket.onmessage = ({ data }) => {
  const { id, result, error } = JSON.parse(data);
  if (id) waiting.get(id)(error ? Promise.reject(new Error(error.message)) : result);
};
const call = (method, params, sessionId) =>
  new Promise((resolve) => {
    number += 1;
    waiting.set(number, resolve);
    socket.send(JSON.stringify({ id: number, method, params, sessionId }));
  });
const { targetId } = await call("Target.createTarget", { url: address, width: 1640, height: 700 });
const { sessionId } = await call("Target.attachToTarget", { targetId, flatten: true });
const evaluate = async (expression) => {
  const { result, exceptionDetails } = await call("Runtime.evaluate", { expression, awaitPromise: true, returnByValue: true }, sessionId);
  if (exceptionDetails) throw new Error(JSON.stringify(exceptionDetails));
  return result.value;
};
const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
await sleep(3000);

// In the page: each drag that is sent is matched with the picture that was ordered for it, and with its coming.
const size = await evaluate(`(() => {
  const canvas = document.querySelector("canvas");
  window.measured = { sent: [], shown: 0, late: [] };
  const ordered = [];
  const send = WebSocket.prototype.send;
  WebSocket.prototype.send = function (text) {
    if (!this.measured) {
      this.measured = true;
      this.addEventListener("message", ({ data }) => {
        if (typeof data !== "string" || measured.sent.length === 0) return;
        const { state } = JSON.parse(data);
        if (state?.picture) ordered.push([state.picture[0], measured.sent.shift()]);
      });
    }
    if (text.includes('"drag"')) measured.sent.push(performance.now());
    return send.call(this, text);
  };
  canvas.addEventListener("picture", ({ detail }) => {
    measured.shown += 1;
    while (ordered.length > 0 && ordered[0][0] <= detail) measured.late.push(performance.now() - ordered.shift()[1]);
  });
  const box = canvas.getBoundingClientRect();
  return { left: box.left, top: box.top, width: box.width, height: box.height, pixels: [canvas.width, canvas.height] };
})()`);
const mouse = (type, x, y) =>
  call("Input.dispatchMouseEvent", { type, x: size.left + x * size.width, y: size.top + y * size.height, button: "left", buttons: 1, clickCount: 1 }, sessionId);
await mouse("mousePressed", 0.66, 0.67);
const begin = performance.now();
while (performance.now() - begin < SECONDS * 1000) {
  const angle = (performance.now() - begin) / 600;
  await mouse("mouseMoved", 0.55 + 0.1 * Math.cos(angle), 0.7 + 0.06 * Math.sin(angle));
  await sleep(8);
}
const seconds = (performance.now() - begin) / 1000;
const { shown, late } = await evaluate("measured");
await mouse("mouseReleased", 0.55, 0.7);
late.sort((a, b) => a - b);
const at = (share) => late[Math.floor(share * (late.length - 1))]?.toFixed(1);
console.log(
  `${size.pixels.join(" x ")}: ${(shown / seconds).toFixed(1)} pictures a second; from pointer to canvas ${at(0.5)} ms, p95 ${at(0.95)} ms (${late.length} moves)`,
);
socket.close();
browser.kill();
server.kill("SIGINT");
await Promise.all([browser, server].map((child) => child.exitCode ?? new Promise((resolve) => child.on("exit", resolve))));
rmSync(folder, { recursive: true, force: true, maxRetries: 5 });
