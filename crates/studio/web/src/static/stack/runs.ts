// Runs in the bucket of the stack that serves the page, as the page asks for them: what the program answers by `runs/routes.rs`.
// A person's runs are below a folder of their own, whose name the page does not show.

import type { Answer } from "../../connection/runs";
import type { RunState, RunUpdate, Summary, UploadProgress } from "../../protocol";
import { notice, state } from "../../store";
import { write } from "../connection";
import { bytesOf, textOf, type File } from "../module";
import { Bucket } from "./bucket";
import { estimated, wanted, type Wanted } from "./offer";
import { isSignedIn, leave } from "./person";
import { haveFiles, named, versionsOf } from "./receipts";
import { Refused } from "./refused";
import { retryOf, type Scope } from "./retry";
import { stack } from "./stack";
import { faults, frameUpdate, isBehind, manifestOf, outputsOf, summary, type Known, type Manifest, type Output } from "./standing";
import { Zip } from "./zip";

export type { Answer } from "../../connection/runs";

/** The most runs of a list. */
const LISTED = 200;

/** Milliseconds between two looks at a run, at first and later. */
const PAUSE = [500, 3000] as const;

/** The most frames that are fetched at the same time, or objects that are changed. */
const AT_ONCE = 8;

const uploads = new Map<string, UploadProgress>();
let ended = 0;

/** Returns the bucket. If nobody has signed in, the browser leaves the page for it, unless the page asks by itself. */
async function bucket(mayLeave = false): Promise<{ readonly bucket: Bucket; readonly name: string; readonly folder: string }> {
  const known = await stack();
  if (!known) throw new Refused("no stack serves this page");
  if (mayLeave && known.signIn && !isSignedIn(known)) {
    await write();
    await leave(known.signIn);
  }
  const own = new Bucket(known);
  return { bucket: own, name: known.bucket, folder: await own.folder() };
}

function checked(run: string): string {
  const isName = run.length <= 700 && run.split("/").every((part) => part !== "" && part !== "." && part !== ".." && !part.startsWith("."));
  if (!isName) throw new Refused(`${run || "nothing"} is no name of a run: expected words with slashes between them`);
  return run;
}

async function outputs(own: Bucket, animation: string, known: Known): Promise<Output[]> {
  const found = outputsOf(known).map(async (ending) => {
    const file = await own.head(`animations/${animation}.${ending}`);
    return file && { ending, ...file };
  });
  return (await Promise.all(found)).filter((output) => output !== null);
}

/** Returns the names of the objects below a folder, with their versions and sizes. */
async function below(own: Bucket, folder: string, isLevel: boolean): Promise<Map<string, { readonly etag: string; readonly size: number }>> {
  return new Map((await own.list(folder, isLevel)).map(({ key, etag, size }) => [key.slice(folder.length), { etag, size }]));
}

const scripts = (own: Bucket, animation: string): ReturnType<typeof below> => below(own, `scripts/${animation}/`, true);

const receipts = async (own: Bucket, animation: string, isLevel: boolean): Promise<string[]> => [...(await below(own, `frames/${animation}/`, isLevel)).keys()];

/** Returns the versions of a run's scripts and settings as they are now. */
async function versions(own: Bucket, animation: string, known: Manifest): Promise<Map<string, string>> {
  const there = new Map(Array.from(await scripts(own, animation), ([name, { etag }]) => [name, etag]));
  return versionsOf(there, haveFiles(there, known.frames) ? await receipts(own, animation, true) : []);
}

/** Does something to all items, some of them at the same time. */
async function each<T>(items: readonly T[], act: (item: T) => Promise<unknown>): Promise<void> {
  for (let at = 0; at < items.length; at += AT_ONCE) await Promise.all(items.slice(at, at + AT_ONCE).map(act));
}

/** A run as it was looked at last. */
interface Seen {
  /** The text of the manifest. */
  readonly text: string | null;
  readonly manifest: Manifest | null;
  readonly summary: Summary;
}

/** Looks at a run. One that is settled is what it was, as long as its manifest is. */
async function look(own: Bucket, folder: string, run: string, before: Seen | null = null): Promise<Seen> {
  const animation = `${folder}/${run}`;
  const content = await own.get(`manifests/${animation}.json`);
  const text = content && textOf(content);
  if (before?.summary.settled && before.text === text) return before;
  const known = manifestOf(animation, text);
  if (known === "new") return { text, summary: summary(run, known, [], false), manifest: null };
  if (known === "unreadable") return { text, summary: summary(run, known, await outputs(own, animation, known), false), manifest: null };
  const [made, there] = await Promise.all([outputs(own, animation, known), versions(own, animation, known)]);
  return { text, summary: summary(run, known, made, isBehind(known, there)), manifest: known };
}

async function list(): Promise<object> {
  const { bucket: own, name, folder } = await bucket(true);
  const start = `manifests/${folder}/`;
  const made = (await own.list(start)).map(({ key }) => key.slice(start.length)).filter((key) => key.endsWith(".json"));
  const names = [...new Set([...made.map((key) => key.slice(0, -".json".length)), ...uploads.keys()])].sort();
  const runs = await Promise.all(names.slice(0, LISTED).map(async (run) => (await look(own, folder, run)).summary));
  return { bucket: name, runs, more: Math.max(0, names.length - LISTED) };
}

interface Difference {
  readonly upload: readonly File[];
  readonly unchanged: number;
  /** Keys of scripts that the page does not have. */
  readonly remove: readonly string[];
}

async function difference(own: Bucket, animation: string, { files: all }: Wanted): Promise<Difference> {
  const there = await scripts(own, animation);
  const upload: File[] = [];
  for (const file of all) {
    const known = there.get(file.name);
    const old = known?.size === file.content.length ? await own.get(`scripts/${animation}/${file.name}`) : null;
    if (!old || old.some((byte, at) => byte !== file.content[at])) upload.push(file);
  }
  const names = new Set(all.map(({ name }) => name));
  const surplus = [...there.keys()].filter((name) => name.endsWith(".txt") && !names.has(name));
  return { upload, unchanged: all.length - upload.length, remove: surplus.map((name) => `scripts/${animation}/${name}`) };
}

async function offer(run: string): Promise<object> {
  const { bucket: own, folder } = await bucket(true);
  const animation = `${folder}/${checked(run)}`;
  const all = await wanted();
  const estimate = await estimated(all);
  const { upload, unchanged, remove } = await difference(own, animation, all);
  const frames = state.value?.frames ?? 0;
  return { estimate, frames, folder: `scripts/${folder}/${run}/`, upload: upload.length, unchanged, delete: remove };
}

async function submit(run: string, deletable: readonly string[]): Promise<object> {
  const { bucket: own, folder } = await bucket(true);
  const animation = `${folder}/${checked(run)}`;
  if (uploads.get(run)?.is === "uploading") throw new Refused("it is being sent already");
  const { upload, remove } = await difference(own, animation, await wanted());
  if (remove.some((key) => !deletable.includes(key))) throw new Refused("the bucket holds scripts that are not on the page", { delete: remove });
  uploads.set(run, { is: "uploading", done: 0, total: upload.length });
  const send = async (): Promise<void> => {
    for (const key of remove) await own.remove(key);
    for (const [at, { name, content }] of upload.entries()) {
      await own.put(`scripts/${animation}/${name}`, content.slice());
      uploads.set(run, { is: "uploading", done: at + 1, total: upload.length });
    }
    uploads.delete(run);
  };
  send()
    .catch((error: unknown) => uploads.set(run, { is: "failed", why: why(error) }))
    .finally(() => (ended += 1));
  return {};
}

/** Draws a frame again, or all that are not drawn. */
async function retry(run: string, scope: Scope): Promise<object> {
  const { bucket: own, folder } = await bucket(true);
  const animation = `${folder}/${checked(run)}`;
  const content = await own.get(`manifests/${animation}.json`);
  const known = manifestOf(animation, content && textOf(content));
  if (typeof known === "string") throw new Refused(known === "new" ? `there is no run ${run}` : `the manifest of ${run} cannot be read`);
  const { remove, orders, reassembled } = retryOf(known, await receipts(own, animation, false), scope);
  await each(remove, (name) => own.remove(`frames/${animation}/${name}`));
  const body = bytesOf(JSON.stringify({ woken_by: "the page" })) as Uint8Array<ArrayBuffer>;
  await each(orders, (name) => own.put(`retries/${animation}/${name}`, body.slice()));
  return { woken: orders.length, reassembled };
}

/** Returns a zip file of the frames that are drawn, and says which are not. */
async function framesZip(own: Bucket, animation: string, run: string): Promise<Blob> {
  const content = await own.get(`manifests/${animation}.json`);
  const known = manifestOf(animation, content && textOf(content));
  if (typeof known === "string") throw new Refused(`${run} has no frames`);
  const { frames } = known;
  const zip = new Zip();
  const digits = String(frames.length).length;
  const fetched = frames.map((frame, at) => ({ frame, at })).filter(({ frame }) => frame.state === "done");
  for (let next = 0; next < fetched.length; next += AT_ONCE) {
    notice.value = `Fetching frames: ${next} of ${fetched.length}.`;
    const some = fetched.slice(next, next + AT_ONCE);
    const contents = await Promise.all(some.map(({ frame: { script, version, pixels = 1, part } }) => own.get(`frames/${animation}/${named(script, version, pixels, part)}.png`)));
    for (const [place, { at }] of some.entries()) {
      const picture = contents[place];
      if (!picture) throw new Refused(`frame ${at + 1} of ${run} is gone: it is being drawn again`);
      zip.add(`frame${String(at + 1).padStart(digits, "0")}.png`, picture);
    }
  }
  const missing = frames.flatMap(({ state }, at) => (state === "done" ? [] : [at + 1]));
  const more = missing.length > 10 ? ` and ${missing.length - 10} more` : "";
  notice.value = missing.length > 0 ? `The zip file lacks what is not drawn: frame ${missing.slice(0, 10).join(", ")}${more}.` : `All ${frames.length} frames are in the zip file.`;
  return zip.finish();
}

const why = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** Answers as the program does at these addresses. */
export async function ask(what: string, body?: object): Promise<Answer> {
  try {
    const { pathname, searchParams } = new URL(what, "rayfold://page/");
    const wish = (body ?? {}) as Scope & { readonly run?: string; readonly delete?: readonly string[] };
    const of: Readonly<Record<string, () => Promise<object>>> = {
      "/runs/list": list,
      "/runs/offer": () => offer(searchParams.get("run") ?? ""),
      "/runs/submit": () => submit(wish.run ?? "", wish.delete ?? []),
      "/runs/retry": () => retry(wish.run ?? "", wish),
    };
    const answer = of[pathname];
    if (!answer) throw new Error(`there is no ${pathname}`);
    return { ok: true, text: JSON.stringify(await answer()) };
  } catch (error) {
    return { ok: false, text: JSON.stringify({ why: why(error), ...(error instanceof Refused && error.more) }) };
  }
}

/** Returns a file of a run by its address, or nothing if there is none. */
export async function get(address: string): Promise<Uint8Array<ArrayBuffer> | Blob | null> {
  const { pathname, searchParams } = new URL(address, "rayfold://page/");
  const of = (name: string): string => searchParams.get(name) ?? "";
  const { bucket: own, folder } = await bucket();
  const run = checked(of("run"));
  const animation = `${folder}/${run}`;
  if (pathname === "/runs/file") return own.get(`animations/${animation}.${of("output")}`);
  if (pathname === "/runs/frames.zip") return framesZip(own, animation, run);
  const part = searchParams.get("part");
  return own.get(`frames/${animation}/${named(of("script"), of("version"), Number(of("pixels")), part === null ? undefined : Number(part))}.png`);
}

/** Hears the state of a run, and each change of it, until the returned function is called. */
export function watch(address: string, hear: (update: RunUpdate) => void): () => void {
  const run = new URL(address, "rayfold://page/").searchParams.get("run") ?? "";
  const begun = Date.now();
  let [last, isOver] = ["", false];
  let known: RunState = { run, status: "new", done: 0, failed: 0, total: 0, behind: false, settled: false, files: [], faults: [], moreFaults: 0, sending: null, problem: null };
  let seen: Seen | null = null;
  let uploaded = ended;
  const poll = async (): Promise<void> => {
    if (uploaded !== ended) seen = null;
    uploaded = ended;
    try {
      const { bucket: own, folder } = await bucket();
      seen = await look(own, folder, checked(run), seen);
      const more = seen.manifest ? faults(run, seen.manifest) : { faults: [], moreFaults: 0 };
      known = { ...seen.summary, ...more, sending: null, problem: null };
    } catch (error) {
      known = { ...known, problem: why(error) };
    }
    const update: RunUpdate = { ...known, sending: uploads.get(run) ?? null, frames: seen?.manifest?.frames.map(frameUpdate) ?? [] };
    const text = JSON.stringify(update);
    if (text !== last && !isOver) hear(update);
    last = text;
    const pause = known.settled && uploaded === ended ? PAUSE[1] : Math.min(Math.max((Date.now() - begun) / 20, PAUSE[0]), PAUSE[1]);
    if (!isOver) setTimeout(() => void poll(), pause);
  };
  void poll();
  return () => (isOver = true);
}
