// Runs in a bucket, as signals: the shown run, which is the fragment of the page's address, and the messages of the server
// about it. The address is the only state: a page that is opened again shows the same run.

import { computed, signal } from "@preact/signals";

import { ask, watch } from "#runs";

import type { FaultInfo, FrameUpdate, RunState, RunUpdate, Summary } from "../protocol";
import { notice, state } from "../store";

export type View =
  | { readonly what: "closed" | "list" | "submit" }
  | { readonly what: "run"; readonly run: string };

/** A run with all its frames. */
export type Run = RunState & { readonly frames: readonly FrameUpdate[] };

export interface List {
  /** `null` if the server was started without a bucket. */
  readonly bucket: string | null;
  readonly runs: readonly Summary[];
  readonly more: number;
}

export interface Refusal {
  readonly why: string;
  readonly script?: string;
  readonly place?: readonly [number, number];
  readonly delete?: readonly string[];
}

export interface CostLine {
  readonly item: string;
  readonly amount: number;
  readonly unit: string;
  readonly usd: number;
}

export interface Section {
  readonly title: string;
  readonly lines: readonly CostLine[];
  readonly usd: number;
}

export interface Offer {
  /** Nothing where it is not known. */
  readonly estimate: {
    readonly frames: number;
    readonly size: readonly [number, number];
    readonly drawingMs: number;
    readonly prices: string;
    readonly sections: readonly Section[];
  } | null;
  /** Where there is no estimate. */
  readonly frames?: number;
  readonly folder: string;
  readonly upload: number;
  readonly unchanged: number;
  readonly delete: readonly string[];
}

export const view = signal<View>({ what: "closed" });
export const list = signal<List | null>(null);
export const run = signal<Run | null>(null);
export const offer = signal<Offer | null>(null);
export const refusal = signal<Refusal | null>(null);
/** Whether a response is awaited. */
export const waiting = signal(false);

/** The default name under which the project is submitted. */
export const ownName = computed(() => (state.value?.title ?? "").replace(/\.txt$/, ""));

let stop: (() => void) | null = null;

export function address(of: View): string {
  return of.what === "run" ? `#run=${encodeURIComponent(of.run)}` : of.what === "closed" ? "#" : `#${of.what === "list" ? "runs" : "submit"}`;
}

export function go(to: View): void {
  if (to.what === "closed") {
    history.pushState(null, "", location.pathname);
    look();
  } else location.hash = address(to);
}

function viewOf(hash: string): View {
  if (hash === "#runs") return { what: "list" };
  if (hash === "#submit") return { what: "submit" };
  if (!hash.startsWith("#run=")) return { what: "closed" };
  try {
    return { what: "run", run: decodeURIComponent(hash.slice(5)) };
  } catch {
    return { what: "list" };
  }
}

/** Returns an address under `runs/` with a query. */
export function resource(name: string, query: Readonly<Record<string, string | number | undefined>>): string {
  const pairs = Object.entries(query).flatMap(([key, value]) => (value === undefined ? [] : [[key, String(value)]]));
  return `runs/${name}?${new URLSearchParams(pairs)}`;
}

export function picture(of: string, { script, version, part, pixels }: FrameUpdate): string {
  return resource("frame.png", { run: of, script, version, part, pixels });
}

async function asked(what: string, body?: object): Promise<unknown> {
  refusal.value = null;
  waiting.value = true;
  const { ok, text } = await ask(what, body);
  waiting.value = false;
  if (ok) return text === "" ? {} : (JSON.parse(text) as unknown);
  refusal.value = text.startsWith("{") ? (JSON.parse(text) as Refusal) : { why: text };
  return null;
}

export async function fetchList(): Promise<void> {
  list.value = (await asked("runs/list")) as List | null;
}

/** The scripts that would be uploaded under a name, and the cost. */
export async function fetchOffer(name: string): Promise<void> {
  offer.value = null;
  offer.value = (await asked(resource("offer", { run: name }))) as Offer | null;
}

export async function submit(name: string, deleting: readonly string[]): Promise<void> {
  if (await asked("runs/submit", { run: name, delete: deleting })) go({ what: "run", run: name });
}

export async function retry(name: string, fault?: FaultInfo): Promise<void> {
  const one = fault?.script === undefined ? {} : { script: fault.script, part: fault.part };
  const woken = (await asked("runs/retry", { run: name, ...one })) as { readonly woken: number } | null;
  if (woken) notice.value = woken.woken === 1 ? "1 frame is drawn again." : woken.woken ? `${woken.woken} frames are drawn again.` : "The files are made again.";
}

function receive(update: RunUpdate): void {
  const frames = update.frames ?? run.value?.frames.slice() ?? [];
  const all = frames.slice();
  for (const [at, frame] of update.changed ?? []) all[at] = frame;
  run.value = { ...update, frames: all };
}

/** Shows the run in the address. */
function look(): void {
  const next = viewOf(location.hash);
  view.value = next;
  stop?.();
  stop = null;
  run.value = null;
  refusal.value = null;
  offer.value = null;
  if (next.what === "list" || next.what === "submit") void fetchList();
  if (next.what === "run") stop = watch(resource("events", { run: next.run }), receive);
}

export function follow(): void {
  addEventListener("hashchange", look);
  look();
}
