// The keys that are chosen in the timeline, and what is done with them.

import { computed, signal } from "@preact/signals";

import type { KeyPlace, Mode, TimeWish, Track } from "./protocol";
import { ask, tracks } from "./store";

/** How many frames an animation begins with. */
const FRAMES = 50;

export const chosenKeys = signal<readonly KeyPlace[]>([]);

/** Whether the player starts again at the end. */
export const looping = signal(true);

/** By how many frames the chosen keys are being dragged. */
export const dragged = signal(0);

export const nameOf = (key: KeyPlace): string => `${key.line}:${key.number}:${key.frame}`;

/** The chosen keys as they are now, while they are dragged. */
const here = computed(() => chosenKeys.value.map((key) => ({ ...key, frame: key.frame + dragged.value })));

export const chosenNames = computed(() => new Set(here.value.map(nameOf)));

/** The tracks of which a key is chosen. */
export const chosenTracks = computed((): readonly Track[] => {
  const named = new Set(chosenKeys.value.map((key) => `${key.line}:${key.number}`));
  return tracks.value.tracks.filter((track) => named.has(`${track.line}:${track.number}`));
});

export function keysOf(track: Track): readonly KeyPlace[] {
  return track.keys.map(([frame]) => ({ line: track.line, number: track.number, frame }));
}

export function hasKeys(): boolean {
  const there = new Set(tracks.value.tracks.flatMap((track) => keysOf(track).map(nameOf)));
  return chosenKeys.value.some((key) => there.has(nameOf(key)));
}

export function wish(what: TimeWish): void {
  ask({ ask: "time", wish: what });
}

export function removeKeys(): void {
  wish({ do: "remove", keys: chosenKeys.value });
  chosenKeys.value = [];
}

export function copyKeys(): void {
  wish({ do: "copy", keys: chosenKeys.value });
}

export function pasteKeys(): void {
  wish({ do: "paste" });
}

export function ease(mode: Mode, cycle: boolean): void {
  wish({ do: "ease", keys: chosenKeys.value, mode, cycle });
}

export function grabKeys(): void {
  dragged.value = 0;
  wish({ do: "grab", keys: chosenKeys.value });
}

export function dragKeys(by: number): void {
  if (by === dragged.value) return;
  dragged.value = by;
  wish({ do: "move", by });
}

export function releaseKeys(): void {
  ask({ ask: "release" });
  chosenKeys.value = here.value;
  dragged.value = 0;
}

/** One picture becomes an animation, in which what is changed gets keys. */
export function animate(): void {
  wish({ do: "frames", count: FRAMES });
  wish({ do: "switch", what: "auto-key", on: true });
}
