// Runs in the bucket of the stack that serves the page, as the page asks for them: what the program answers by `runs/routes.rs`.
// A person's runs are below a folder of their own, whose name the page does not show.

import type { Answer } from "../../connection/runs";
import type { RunState, RunUpdate, Summary, UploadProgress } from "../../protocol";
import { files, state } from "../../store";
import { ownFiles, write } from "../connection";
import { bytesOf, textOf, type File } from "../module";
import { Bucket } from "./bucket";
import { isSignedIn, leave } from "./person";
import { stack } from "./stack";
import { faults, frameFile, frameUpdate, isBehind, manifestOf, outputsOf, summary, type Known, type Manifest, type Output } from "./standing";

export type { Answer } from "../../connection/runs";

/** A person has neither the rights to draw frames again, nor an estimate, nor a zip file of frames. */
export const isOwner = false;

/** The most runs of a list. */
const LISTED = 200;

/** Milliseconds between two looks at a run, at first and later. */
const PAUSE = [500, 3000] as const;

/** A refusal, as the page shows it. */
class Refused extends Error {
  readonly more: object;

  constructor(why: string, more: object = {}) {
    super(why);
    this.more = more;
  }
}

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

async function scripts(own: Bucket, animation: string): Promise<Map<string, { readonly etag: string; readonly size: number }>> {
  const folder = `scripts/${animation}/`;
  const listed = (await own.list(folder)).map(({ key, etag, size }) => [key.slice(folder.length), { etag, size }] as const);
  return new Map(listed.filter(([name]) => !name.includes("/")));
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
  const [made, there] = await Promise.all([outputs(own, animation, known), scripts(own, animation)]);
  const versions = new Map(Array.from(there, ([name, { etag }]) => [name, etag]));
  return { text, summary: summary(run, known, made, isBehind(known, versions)), manifest: known };
}

async function list(): Promise<object> {
  const { bucket: own, name, folder } = await bucket(true);
  const start = `manifests/${folder}/`;
  const made = (await own.list(start)).map(({ key }) => key.slice(start.length)).filter((key) => key.endsWith(".json"));
  const names = [...new Set([...made.map((key) => key.slice(0, -".json".length)), ...uploads.keys()])].sort();
  const runs = await Promise.all(names.slice(0, LISTED).map(async (run) => (await look(own, folder, run)).summary));
  return { bucket: name, runs, more: Math.max(0, names.length - LISTED) };
}

/** The files that the bucket's folder of a run should have, in the order in which they are sent. */
async function wanted(): Promise<File[]> {
  await write();
  const faulty = files.value.find((file) => file.faulty);
  if (faulty) throw new Refused(`${faulty.name} has an error`, { script: faulty.name.replace(/\.txt$/, "") });
  const [, ...own] = await ownFiles();
  const isScript = ({ name }: File): boolean => name.endsWith(".txt");
  const settings = own.find(({ name }) => name === "animation.json");
  const given = settings ? (JSON.parse(textOf(settings.content)) as { readonly frames?: number }) : { fps: state.value?.fps };
  // So that no animation is made before the last script is there.
  const counted = bytesOf(`${JSON.stringify({ frames: state.value?.frames, ...given }, null, 2)}\n`);
  const beside = own.filter((file) => !isScript(file) && file !== settings);
  return [{ name: "animation.json", content: counted }, ...beside, ...own.filter(isScript)];
}

interface Difference {
  readonly upload: readonly File[];
  readonly unchanged: number;
  /** Keys of scripts that the page does not have. */
  readonly remove: readonly string[];
}

async function difference(own: Bucket, animation: string): Promise<Difference> {
  const [all, there] = await Promise.all([wanted(), scripts(own, animation)]);
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
  const { upload, unchanged, remove } = await difference(own, `${folder}/${checked(run)}`);
  const frames = state.value?.frames ?? 0;
  return { estimate: null, frames, folder: `scripts/${folder}/${run}/`, upload: upload.length, unchanged, delete: remove };
}

async function submit(run: string, deletable: readonly string[]): Promise<object> {
  const { bucket: own, folder } = await bucket(true);
  const animation = `${folder}/${checked(run)}`;
  if (uploads.get(run)?.is === "uploading") throw new Refused("it is being sent already");
  const { upload, remove } = await difference(own, animation);
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

const why = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** Answers as the program does at these addresses. */
export async function ask(what: string, body?: object): Promise<Answer> {
  try {
    const { pathname, searchParams } = new URL(what, "rayfold://page/");
    const wish = (body ?? {}) as { readonly run?: string; readonly delete?: readonly string[] };
    const of: Readonly<Record<string, () => Promise<object>>> = {
      "/runs/list": list,
      "/runs/offer": () => offer(searchParams.get("run") ?? ""),
      "/runs/submit": () => submit(wish.run ?? "", wish.delete ?? []),
    };
    const answer = of[pathname];
    if (!answer) throw new Refused("only the owner of the bucket can do this");
    return { ok: true, text: JSON.stringify(await answer()) };
  } catch (error) {
    return { ok: false, text: JSON.stringify({ why: why(error), ...(error instanceof Refused && error.more) }) };
  }
}

/** Returns a file of a run by its address, or nothing if there is none. */
export async function get(address: string): Promise<Uint8Array<ArrayBuffer> | null> {
  const { pathname, searchParams } = new URL(address, "rayfold://page/");
  const named = (name: string): string => searchParams.get(name) ?? "";
  const { bucket: own, folder } = await bucket();
  const animation = `${folder}/${checked(named("run"))}`;
  if (pathname === "/runs/file") return own.get(`animations/${animation}.${named("output")}`);
  return own.get(`frames/${animation}/${frameFile(named("script"), named("version"), named("pixels"), searchParams.get("part"))}`);
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
