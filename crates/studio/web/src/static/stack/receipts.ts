// Receipts by their names below an animation's folder of frames, and the versions of scripts that follow from them
// (docs/pipeline.md, "Keys" and "Files that scripts name").

import { bytesOf } from "../module";
import { hex } from "./sign";

export interface Receipt {
  readonly script: string;
  /** The version of the script as keys have it. */
  readonly version: string;
  readonly pixels: number;
  /** The number of the frame in its script. */
  readonly part?: number;
  /** What follows the full stop. */
  readonly kind: string;
}

/** A version as keys have it. */
export const escaped = (version: string): string =>
  Array.from(bytesOf(version), (byte) => {
    const sign = String.fromCharCode(byte);
    return /[\w-]/.test(sign) ? sign : `~${byte.toString(16).padStart(2, "0")}`;
  }).join("");

/** What the names of a frame's receipts begin with, before the full stop. */
export const named = (script: string, version: string, pixels: number, part?: number): string =>
  `${script}@${escaped(version)}-p${pixels}${part === undefined ? "" : `/${part}`}`;

/** Reads the name of a receipt. Those of the whole animation have no script. */
export function receiptOf(name: string): Receipt | null {
  const [, script = "", version = "", pixels, part, kind = ""] = /^([^/]+)@([\w~-]+)-p(\d+)(?:\/(\d+))?\.(.+)$/.exec(name) ?? [];
  return kind ? { script, version, pixels: Number(pixels), ...(part && { part: Number(part) }), kind } : null;
}

/** Files that a version of a script is drawn from, as its receipts list them. */
interface FileSet {
  readonly numbers: Set<string>;
  readonly entries: string[];
  count: number;
  pixels: number;
}

const digits = async (text: string, count: number): Promise<string> =>
  hex(await crypto.subtle.digest("SHA-256", bytesOf(text) as Uint8Array<ArrayBuffer>)).slice(0, count);

function setsOf(names: readonly string[]): Map<string, FileSet> {
  const sets = new Map<string, FileSet>();
  for (const receipt of names.map(receiptOf)) {
    const [, number = "", count, entries = ""] = /^files-(\d+)-of-(\d+)-((?:[\da-f]{10}(?:-|[\da-f]{8}))+)$/.exec(receipt?.kind ?? "") ?? [];
    if (!receipt || receipt.part !== undefined || !number) continue;
    const of = `${receipt.script}@${receipt.version}`;
    const set = sets.get(of) ?? { numbers: new Set(), entries: [], count: 0, pixels: 0 };
    sets.set(of, set);
    set.numbers.add(number);
    set.entries.push(...(entries.match(/.{10}(?:-|.{8})/g) ?? []));
    [set.count, set.pixels] = [Number(count), Math.max(set.pixels, receipt.pixels)];
  }
  return sets;
}

const isOwn = (name: string): boolean => name.endsWith(".txt") || name === "animation.json";

/** Whether versions of scripts may have files, so that receipts are needed to know them. The files of a manifest's versions may all be absent. */
export const haveFiles = (there: ReadonlyMap<string, string>, frames: readonly { readonly version: string }[]): boolean =>
  [...there.keys()].some((name) => !isOwn(name)) || frames.some(({ version }) => version.includes("+"));

/**
 * Returns the versions of the scripts and of the settings of a folder, by their files' names. `there` has the entity tag of
 * each file, `receipts` the names of the receipts. A script that names files has the version whose files are those that are there.
 */
export async function versionsOf(there: ReadonlyMap<string, string>, receipts: readonly string[]): Promise<Map<string, string>> {
  const own = new Map([...there].filter(([name]) => isOwn(name)));
  const beside = [...there].filter(([name]) => !isOwn(name));
  const files = new Map(await Promise.all(beside.map(async ([name, tag]) => [await digits(name, 10), await digits(tag, 8)] as const)));
  const agrees = ({ numbers, entries, count }: FileSet): boolean =>
    numbers.size === count && entries.every((entry) => (files.get(entry.slice(0, 10)) ?? "-") === entry.slice(10));
  const newest = new Map<string, number>();
  for (const [of, set] of setsOf(receipts)) {
    const [, script = "", tag, files] = /^(.+)@([\w~-]+)~2b([\da-f]{16})$/.exec(of) ?? [];
    const name = `${script}.txt`;
    const known = there.get(name);
    if (known === undefined || tag !== escaped(known) || !agrees(set) || set.pixels < (newest.get(name) ?? 0)) continue;
    newest.set(name, set.pixels);
    own.set(name, `${known}+${files}`);
  }
  return own;
}
