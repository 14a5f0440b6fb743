// What the page's parts compute, without a browser.

import assert from "node:assert/strict";
import { test } from "node:test";

import { load } from "./modules.mjs";

test("copied lines bring the materials and groups that they name, in the order of the script", async () => {
  const { scriptOf } = await load("clipboard.ts");
  const lines = [
    { text: "Screen 4 3", role: "setting", command: "Screen" },
    { text: "Material grain diffuse .1 .1 .1", role: "material", command: "Material", subject: "grain" },
    { text: "Material wood diffuse 1 0 0 noise .5 grain", role: "material", command: "Material", subject: "wood" },
    { text: "Material red diffuse 1 0 0", role: "material", command: "Material", subject: "red" },
    { text: "Group leg", role: "group", command: "Group", subject: "leg" },
    { text: "Box 0 0 0  1 1 1  wood", role: "object", command: "Box" },
    { text: "End", role: "setting", command: "End" },
    { text: "Use leg 1 2 3 # red", role: "use", command: "Use", subject: "leg" },
    { text: "Sphere 1  0 0 0  red # leg", role: "object", command: "Sphere" },
  ];
  const texts = (...of) => of.map((at) => `${lines[at].text}\n`).join("");
  assert.equal(scriptOf(lines, [8]), texts(3, 8));
  assert.equal(scriptOf(lines, [7]), texts(1, 2, 4, 5, 6, 7));
  assert.equal(scriptOf(lines, [8, 7, 99]), texts(1, 2, 3, 4, 5, 6, 7, 8));
});

test("a caret goes over what looks like one character, as CodeMirror's own table has it", async () => {
  const { findClusterBreak } = await load("script/clusters.ts");
  const { findClusterBreak: table } = await import("@marijn/find-cluster-break");
  const family = "\u{1F469}\u200D\u{1F469}\u200D\u{1F467}";
  for (const text of ["", "a", "abc", "a\u0301b", "x\u{1F600}y", `${family}!`, "\u{1F1E9}\u{1F1EA}\u{1F1EB}\u{1F1F7}", "# \u00E4\u00F6 e\u0308\u0301 \u20AC", "\u{1F600}\u{1F3FD}."]) {
    for (const forward of [true, false]) {
      const stops = (next) => {
        const all = [];
        for (let at = forward ? 0 : text.length; at !== (forward ? text.length : 0); ) all.push((at = next(text, at, forward)));
        return all;
      };
      assert.deepEqual(stops(findClusterBreak), stops(table), text);
    }
  }
});

test("keys of other alphabets are named by their places", async () => {
  const { base, shift, keyName } = await load("script/keynames.ts");
  const names = await import("w3c-keyname");
  for (const code of [48, 57, 65, 90, 97, 106, 107, 109, 110, 111, 59, 61, 173, 186, 187, 188, 189, 190, 191, 192, 219, 220, 221, 222]) {
    assert.equal(base[code], names.base[code], `base ${code}`);
    assert.equal(shift[code], names.shift[code], `shift ${code}`);
  }
  assert.equal(keyName({ key: "ArrowLeft", keyCode: 37 }), "ArrowLeft");
  assert.equal(keyName({ key: "Unidentified", keyCode: 90, shiftKey: true }), "Z");
});

test("a step of the server is as small as it can be, and at the caret", async () => {
  const { serverChanges } = await load("script/sync.ts");
  const { Text } = await import("@codemirror/state");
  const spans = (text, at, removed, texts, caret) => {
    const doc = Text.of(text.split("\n"));
    const count = doc.lines - removed + texts.length;
    const changes = serverChanges(doc, [{ at, removed, lines: texts.map((text) => ({ text })) }], false, count, caret);
    const found = [];
    changes.iterChanges((from, to, _from, _to, inserted) => found.push([from, to, String(inserted)]));
    return found;
  };
  assert.deepEqual(spans("ab\ncd\nx", 0, 2, ["abcd"]), [[2, 3, ""]], "a line end that is taken back");
  assert.deepEqual(spans("abcd\nx", 0, 1, ["ab", "cd"]), [[2, 2, "\n"]]);
  assert.deepEqual(spans("aaaa", 0, 1, ["aaa"], 1), [[0, 1, ""]], "typed at the start");
  assert.deepEqual(spans("aaaa", 0, 1, ["aaa"], 4), [[3, 4, ""]]);
  assert.deepEqual(spans("aaa", 0, 1, ["aaaa"], 1), [[1, 1, "a"]]);
  assert.deepEqual(spans("xaay", 0, 1, ["xbby"], 0), [[1, 3, "bb"]]);
});

test("a sun's direction and its angles are the same", async () => {
  const { sunAngles, sunDirection } = await load("inspector/sun.ts");
  assert.deepEqual(sunAngles(0, -1, 0), { azimuth: 0, height: 90 });
  assert.deepEqual(sunDirection({ azimuth: 90, height: 0 }), [-1, 0, 0], "light from the right goes to the left");
  for (const azimuth of [-179, -90, -45, 0, 12.5, 90, 180]) {
    for (const height of [-60, 0, 30, 89]) {
      const again = sunAngles(...sunDirection({ azimuth, height }));
      assert.ok(Math.abs(again.azimuth - azimuth) <= 0.1 && Math.abs(again.height - height) <= 0.1, JSON.stringify([azimuth, height, again]));
    }
  }
});

test("curves have their values with a margin, and the tangents of a bezier curve", async () => {
  const { tangentsOf, valuesOf } = await load("timeline/curves.tsx");
  const { chosenKeys } = await load("timeline/keys.ts");
  const track = (mode) => ({ line: 0, number: 1, label: "x", mode, cycle: false, path: "", keys: [[1, 0], [5, 10], [9, 10], [11, 0]] });
  const [low, high] = valuesOf([track("linear")]);
  assert.ok(low < 0 && high > 10);
  assert.deepEqual(tangentsOf(track("smooth")), []);
  const bezier = track("bezier 0.25 0.1 0.5 2");
  assert.deepEqual(tangentsOf(bezier), [[1, 0], [2, 1], [5, 10], [3, 20]]);
  chosenKeys.value = [{ line: 0, number: 1, frame: 11 }];
  assert.deepEqual(tangentsOf(bezier), [[9, 10], [9.5, 9], [11, 0], [10, -10]], "behind the last key there is no other");
  chosenKeys.value = [{ line: 0, number: 1, frame: 5 }];
  assert.deepEqual(tangentsOf(bezier), [], "nothing changes there");
  chosenKeys.value = [];
});

test("the search finds what has all words, also in another order", async () => {
  const { matching } = await load("top/matching.ts");
  const all = [{ text: "Add Sphere", note: "Sphere" }, { text: "Duplicate", note: "Ctrl+D" }, { text: "small sphere", note: "Sphere" }];
  assert.deepEqual(matching(all, "sphere small").map(({ text }) => text), ["small sphere"]);
  assert.equal(matching(all, "").length, 3);
  assert.equal(matching(all, "ctrl+d")[0].text, "Duplicate");
});

test("a number is read with a comma or a point, and nothing else is one", async () => {
  const { parsed } = await load("parts/number.tsx");
  assert.deepEqual(["1,5", "-.5", "−2", "1e3", " 4 "].map(parsed), [1.5, -0.5, -2, 1000, 4]);
  for (const text of ["", "1,2,3", "1.5,2", "x", "Infinity", "0x10"]) assert.ok(Number.isNaN(parsed(text)), text);
});

/** The page's connection to a server that is played here: what was sent, and how the server answers. */
async function connected(t) {
  const sent = [];
  let socket;
  class Socket {
    static OPEN = 1;
    readyState = 1;
    constructor() {
      socket = this;
    }
    send(text) {
      sent.push(JSON.parse(text));
    }
  }
  const globals = { WebSocket: Socket, location: { href: "http://127.0.0.1/" }, dispatchEvent: () => true };
  const before = Object.keys(globals).map((name) => [name, Object.getOwnPropertyDescriptor(globalThis, name)]);
  for (const [name, value] of Object.entries(globals)) Object.defineProperty(globalThis, name, { value, configurable: true, writable: true });
  t.after(() => before.forEach(([name, was]) => (was ? Object.defineProperty(globalThis, name, was) : delete globalThis[name])));
  const store = await load("store.ts");
  store.connect();
  socket.onopen();
  return { store, sent, hear: (tell) => socket.onmessage({ data: JSON.stringify(tell) }) };
}

test("of a drag the newest place is sent as soon as the one before it is answered, and before the release", async (t) => {
  const { store, sent, hear } = await connected(t);
  const places = () => sent.splice(0).map(({ ask, x }) => x ?? ask);
  store.ask({ ask: "press" });
  hear({ state: { asked: 1, selection: [] } });
  for (const x of [1, 2, 3]) store.drag({ ask: "drag", x });
  assert.deepEqual(places(), ["press", 1], "one is under way");
  hear({ state: { asked: 1, selection: [] } });
  assert.deepEqual(places(), [], "an answer to something before it");
  hear({ state: { asked: 2, selection: [] } });
  assert.deepEqual(places(), [3]);
  hear({ state: { asked: 3, selection: [] } });
  assert.deepEqual(places(), [], "nothing is sent twice");
  for (const x of [4, 5]) store.drag({ ask: "drag", x });
  store.dragNext();
  store.ask({ ask: "release" });
  assert.deepEqual(places(), [4, 5, "release"], "the last place counts");
});

test("a selection that stays is the same array", async (t) => {
  const { store, hear } = await connected(t);
  const after = (selection) => (hear({ state: { asked: 9, selection } }), store.selection.value);
  const first = after([1, 2]);
  assert.equal(after([1, 2]), first);
  assert.deepEqual(after([2, 1]), [2, 1]);
  assert.deepEqual(after([]), []);
});

test("the state of a run follows from its manifest, its outputs and its scripts", async () => {
  const { summary, isBehind, faults, frameUpdate } = await load("static/stack/standing.ts");
  const frame = (script, state, more = {}) => ({ script, version: "v1", state, ...more });
  const manifest = {
    status: "done", generation: "g", total: 2, done: 2, failed: 0, settings: { version: "s", value: { frames: 2 } },
    gif: { generation: "g", version: "e" }, frames: [frame("1", "done", { pixels: 3 }), frame("2", "done", { pixels: 3, version: "v2+f" })],
  };
  const gif = { ending: "gif", etag: "e", size: 9, generation: "g" };
  const of = (now, outputs = [gif], behind = false) => summary("film", now, outputs, behind);
  assert.deepEqual(of(manifest).files, [{ ending: "gif", format: "GIF", bytes: 9, version: "e", current: true }]);
  assert.ok(of(manifest).settled);
  assert.ok(!of(manifest, [gif], true).settled, "newer scripts wait to be seen");
  for (const old of [{ ...gif, generation: "f" }, { ...gif, etag: "copied" }]) assert.ok(!of(manifest, [old]).settled && !of(manifest, [old]).files[0].current);
  assert.ok(!of(manifest, []).settled, "its GIF is still to come");
  assert.equal(of({ ...manifest, total: 1, settings: { value: { frames: 5 } } }).total, 5, "those to come are awaited");
  for (const unknown of ["new", "unreadable"]) assert.equal(of(unknown).status, unknown);
  for (const [status, settled] of [["waiting", false], ["rendering", false], ["failed", true], ["refused", true]]) assert.equal(of({ ...manifest, status }).settled, settled, status);

  const there = new Map([["1.txt", "v1"], ["2.txt", "v2+f"], ["animation.json", "s"]]);
  assert.ok(!isBehind(manifest, there));
  for (const [name, version] of [["1.txt", "new"], ["2.txt", "v2+g"], ["3.txt", "v3"], ["animation.json", "t"]]) assert.ok(isBehind(manifest, new Map([...there, [name, version]])), name);
  for (const name of ["1.txt", "animation.json"]) assert.ok(isBehind(manifest, new Map([...there].filter(([other]) => other !== name))), `${name} is gone`);

  const reason = { message: "m", diagnostics: [{ line: 2, column: 3, message: "unknown", expected: "Sphere" }], omitted: 4 };
  const failed = { ...manifest, rejected: [{ key: "scripts/x", problem: "p" }], frames: [frame("1", "failed", { part: 2, reason }), frame("2", "waiting")] };
  assert.deepEqual(faults("film", failed), {
    faults: [
      { what: "scripts/x", message: "p", help: "" },
      { what: "1.txt, frame 2", script: "1", part: 2, place: [2, 3], message: "unknown", help: "Sphere" },
      { what: "1.txt, frame 2", script: "1", part: 2, message: "and 4 more", help: "" },
      { what: "2.txt", script: "2", message: "no reason is known yet", help: "" },
    ],
    moreFaults: 0,
  });
  assert.deepEqual(frameUpdate(failed.frames[1]), { script: "2", version: "v1", state: "pending" });
});

test("receipts are read and written by their names, and what failed is drawn again", async () => {
  const { named, receiptOf } = await load("static/stack/receipts.ts");
  const { retryOf } = await load("static/stack/retry.ts");
  assert.equal(named("a b", "x+y.z", 3), "a b@x~2by~2ez-p3");
  assert.equal(named("1", "v", 3, 7), "1@v-p3/7");
  assert.deepEqual(receiptOf("a@b-p1.c@v~2bf-p3/7.begun-2"), { script: "a@b-p1.c", version: "v~2bf", pixels: 3, part: 7, kind: "begun-2" });
  for (const name of ["@assembler.json", `@${"0".repeat(32)}.error.json`, "sub/1@v-p1.png", "1.png", "1@v.png", "1@v-p1"]) assert.equal(receiptOf(name), null, name);

  const frames = [
    { script: "1", version: "v", state: "done", pixels: 3 },
    { script: "2", version: "w+f", part: 1, state: "failed" },
    { script: "2", version: "w+f", part: 2, state: "done", pixels: 3 },
    { script: "3", version: "x", state: "pending" },
  ];
  const refusal = `@${"0123".repeat(8)}.webp.error.json`;
  const receipts = [
    "1@v-p3.png", "1@old-p3.error.json", "1@v-p2.error.json", "2@w~2bf-p3/1.error.json", "2@w~2bf-p2/1.begun-1", "2@w~2bf-p3/1.cut-4", "2@w~2bf-p3/1.1-of-4.band",
    "2@w~2bf-p3/2.png", "2@w~2bf-p3/2.error.json", "2@w-p3/1.error.json", "3@x-p3.begun-2", "3@x-p3.begun-12", "3@x-p3.taken", "@assembler.json", refusal,
  ];
  assert.deepEqual(retryOf({ frames }, receipts, {}), {
    remove: [refusal, "2@w~2bf-p3/1.error.json", "2@w~2bf-p2/1.begun-1", "3@x-p3.begun-2"],
    orders: ["2@w~2bf-p3/1/1", "3@x-p3/1"],
    reassembled: true,
  });
  assert.deepEqual(retryOf({ frames }, receipts.slice(0, -1), { script: "2", part: 2 }), { remove: ["2@w~2bf-p3/2.error.json"], orders: ["2@w~2bf-p3/2/1"], reassembled: false });
  assert.deepEqual(retryOf({ frames }, [], { script: "2" }).orders, [], "a part is not the script");
});

// The example of the documentation of AWS has other headers: this is its method, in another implementation.
test("requests to S3 are signed", async () => {
  const { createHash, createHmac } = await import("node:crypto");
  const { signed, encoded } = await load("static/stack/sign.ts");
  const keys = { accessKey: "AKID", secretKey: "secret", sessionToken: "token" };
  const url = new URL(`https://b.s3.eu-central-1.amazonaws.com/scripts/${encoded("eu:1 (a)!")}/1.txt?list-type=2&prefix=${encoded("a/*")}`);
  const headers = await signed({ method: "PUT", url, body: new Uint8Array([1, 2]) }, keys, "eu-central-1", new Date("2026-03-04T05:06:07.890Z"));
  const sha = (content) => createHash("sha256").update(content).digest("hex");
  const mac = (key, text) => createHmac("sha256", key).update(text).digest();
  const content = sha(Buffer.from([1, 2]));
  const names = "host;x-amz-content-sha256;x-amz-date;x-amz-security-token";
  const canonical = `PUT\n/scripts/eu%3A1%20%28a%29%21/1.txt\nlist-type=2&prefix=a%2F%2A\nhost:b.s3.eu-central-1.amazonaws.com\nx-amz-content-sha256:${content}\nx-amz-date:20260304T050607Z\nx-amz-security-token:token\n\n${names}\n${content}`;
  const scope = "20260304/eu-central-1/s3/aws4_request";
  const key = scope.split("/").reduce((key, part) => mac(key, part), "AWS4secret");
  const signature = mac(key, `AWS4-HMAC-SHA256\n20260304T050607Z\n${scope}\n${sha(canonical)}`).toString("hex");
  assert.equal(headers.authorization, `AWS4-HMAC-SHA256 Credential=AKID/${scope}, SignedHeaders=${names}, Signature=${signature}`);
});
