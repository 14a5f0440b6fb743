// Drawing frames of a run again: what `rayfold retry` does to the bucket (docs/pipeline.md), as far as a person's rights reach.
// Contains values only.
//
// A person may not write the manifest: the function that draws a frame again does. Bands of a frame stay, and those that
// are missing are drawn. So do the earlier orders to draw it; with three of them, a failure is left to the sweep.

import { escaped, named, receiptOf } from "./receipts";
import type { Manifest } from "./standing";

/** A frame; without a script all that are not drawn. */
export interface Scope {
  readonly script?: string;
  readonly part?: number;
}

export interface Retry {
  /** The names of receipts to be deleted first. */
  readonly remove: readonly string[];
  /** The names of orders to be written, below the animation's folder of retries. */
  readonly orders: readonly string[];
  /** The files had been refused; the sweep has them made again. */
  readonly reassembled: boolean;
}

/** Returns what draws frames again. `receipts` are the names of all receipts of the animation. */
export function retryOf({ frames }: Manifest, receipts: readonly string[], scope: Scope): Retry {
  const wanted = frames.filter(({ script, part, state }) =>
    scope.script === undefined ? state !== "done" : script === scope.script && part === scope.part,
  );
  const identity = (script: string, version: string, part?: number): string => `${script}@${version}/${part ?? ""}`;
  const own = new Set(wanted.map(({ script, version, part }) => identity(script, escaped(version), part)));
  const refusals = receipts.filter((name) => /^@[\da-f]{32}(\.\w+)?\.error\.json$/.test(name));
  const failures = receipts.filter((name) => {
    const receipt = receiptOf(name);
    return receipt && /^(error\.json|begun-\d)$/.test(receipt.kind) && own.has(identity(receipt.script, receipt.version, receipt.part));
  });
  const pixels = Math.max(1, ...receipts.map((name) => receiptOf(name)?.pixels ?? 1));
  return {
    remove: [...refusals, ...failures],
    orders: wanted.map(({ script, version, part }) => `${named(script, version, pixels, part)}/1`),
    reassembled: refusals.length > 0,
  };
}
