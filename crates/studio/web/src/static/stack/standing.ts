// The state of a run for the page, from its manifest (docs/manifest.md) and the versions of its scripts. Contains values only; the
// program computes the same in `runs/updates.rs`. Tests compare both on the cases in `runs/standing.json`.

import type { FaultInfo, FrameUpdate, RunFile, Summary } from "../../protocol";

/** The most faults that are listed. */
const FAULTS = 100;

const FORMATS: Readonly<Record<string, string>> = { gif: "GIF", webp: "WebP", apng: "APNG", y4m: "Y4M" };

interface Reason {
  readonly message: string;
  readonly diagnostics?: readonly { readonly line: number; readonly column: number; readonly message: string; readonly expected?: string; readonly help?: string }[];
  readonly omitted?: number;
}

interface Frame {
  readonly script: string;
  readonly version: string;
  readonly part?: number;
  readonly state: "pending" | "done" | "waiting" | "failed";
  readonly pixels?: number;
  readonly reason?: Reason;
}

interface Made {
  readonly generation: string;
  readonly version: string;
}

/** The version of manifests that is read here. */
const SCHEMA = 1;

export interface Manifest {
  readonly schema: number;
  readonly animation: string;
  readonly status: "empty" | "waiting" | "rendering" | "failed" | "refused" | "done";
  readonly generation: string;
  readonly total: number;
  readonly done: number;
  readonly failed: number;
  readonly settings: { readonly version?: string; readonly value?: { readonly frames?: number; readonly outputs?: readonly string[] }; readonly fault?: Reason };
  readonly rejected?: readonly { readonly key: string; readonly problem: string }[];
  readonly refusal?: { readonly reason?: Reason };
  readonly excess?: Reason;
  readonly gif?: Made;
  readonly outputs?: Readonly<Record<string, Made>>;
  readonly frames: readonly Frame[];
}

/** An output as the bucket has it. */
export interface Output {
  readonly ending: string;
  readonly etag: string;
  readonly size: number;
  readonly generation: string | null;
}

/** A manifest, or the reason why there is none. */
export type Known = Manifest | "new" | "unreadable";

/** Reads the manifest of an animation. One of a later schema or of another animation is unreadable. */
export function manifestOf(animation: string, text: string | null): Known {
  if (text === null) return "new";
  try {
    const read = JSON.parse(text) as Manifest | null;
    return read && read.schema <= SCHEMA && read.animation === animation ? read : "unreadable";
  } catch {
    return "unreadable";
  }
}

/** The endings of the files that are made of an animation. */
export const outputsOf = (known: Known): readonly string[] => (typeof known !== "string" && known.settings.value?.outputs) || ["gif"];

/** Whether the manifest is about other versions of scripts and settings than those that are there, by their files' names. */
export function isBehind({ frames, settings }: Manifest, there: ReadonlyMap<string, string>): boolean {
  const seen = new Map(frames.map(({ script, version }) => [`${script}.txt`, version]));
  if (settings.version !== undefined) seen.set("animation.json", settings.version);
  return there.size !== seen.size || [...there].some(([name, version]) => seen.get(name) !== version);
}

/** The state of a run. */
export function summary(run: string, known: Known, outputs: readonly Output[], behind: boolean): Summary {
  const isCurrent = ({ ending, etag, generation }: Output): boolean => {
    if (behind || typeof known === "string" || known.status !== "done") return false;
    const made = ending === "gif" ? known.gif : known.outputs?.[ending];
    const isOther = made?.generation === known.generation && made.version !== etag;
    return generation === known.generation && !isOther;
  };
  const files = outputs.map((output): RunFile => ({
    ending: output.ending,
    format: FORMATS[output.ending] ?? output.ending,
    bytes: output.size,
    version: output.etag,
    current: isCurrent(output),
  }));
  if (typeof known === "string") return { run, status: known, done: 0, failed: 0, total: 0, behind: false, settled: false, files };
  const isComplete = outputsOf(known).every((ending) => files.some((file) => file.ending === ending && file.current));
  const settled = { empty: files.length === 0, waiting: false, rendering: false, failed: true, refused: true, done: isComplete }[known.status];
  const total = Math.max(known.total, known.settings.value?.frames ?? 0);
  return { run, status: known.status, done: known.done, failed: known.failed, total, behind, settled: settled && !behind, files };
}

export function frameUpdate({ script, version, part, state, pixels }: Frame): FrameUpdate {
  return { script, version, ...(part !== undefined && { part }), state: state === "waiting" ? "pending" : state, ...(pixels !== undefined && { pixels }) };
}

function faultsOf(what: string, reason: Reason | undefined, frame?: Frame): FaultInfo[] {
  const own = frame ? { script: frame.script, ...(frame.part !== undefined && { part: frame.part }) } : {};
  const fault = (message: string): FaultInfo => ({ what, ...own, message, help: "" });
  if (!reason) return [fault("no reason is known yet")];
  if (!reason.diagnostics?.length) return [fault(reason.message)];
  const all = reason.diagnostics.map(({ line, column, message, expected, help }): FaultInfo => ({
    ...fault(message),
    place: [line, column],
    help: help ?? expected ?? "",
  }));
  return reason.omitted ? [...all, fault(`and ${reason.omitted} more`)] : all;
}

/** The faults that keep a run from being done, and how many are not listed. */
export function faults(run: string, manifest: Manifest): { readonly faults: readonly FaultInfo[]; readonly moreFaults: number } {
  const all = [
    ...(manifest.rejected ?? []).map(({ key, problem }): FaultInfo => ({ what: key, message: problem, help: "" })),
    ...(manifest.settings.fault ? faultsOf("animation.json", manifest.settings.fault) : []),
    ...(manifest.excess ? faultsOf(run, manifest.excess) : []),
    ...manifest.frames
      .filter(({ state }) => state === "failed" || state === "waiting")
      .flatMap((frame) => faultsOf(frame.part === undefined ? `${frame.script}.txt` : `${frame.script}.txt, frame ${frame.part}`, frame.reason, frame)),
    ...(manifest.refusal ? faultsOf(`the GIF of ${run}`, manifest.refusal.reason) : []),
  ];
  return { faults: all.slice(0, FAULTS), moreFaults: Math.max(0, all.length - FAULTS) };
}
