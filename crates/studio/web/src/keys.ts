// The selected keys of the timeline, and the edits of them.

import { computed, signal } from "@preact/signals";

import type { KeyPlace, Mode, TimeWish, Track } from "./protocol";
import { ask, tracks } from "./store";

/** The initial number of frames of an animation. */
const FRAMES = 50;

export const chosenKeys = signal<readonly KeyPlace[]>([]);

/** Whether playback loops. */
export const looping = signal(true);

/** The number of frames by which the selected keys are being dragged. */
export const dragged = signal(0);

export const nameOf = (key: KeyPlace): string => `${key.line}:${key.number}:${key.frame}`;

/** The current positions of the selected keys while they are dragged. */
const here = computed(() => chosenKeys.value.map((key) => ({ ...key, frame: key.frame + dragged.value })));

export const chosenNames = computed(() => new Set(here.value.map(nameOf)));

/** The tracks with a selected key. */
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

/** Makes an animation of a single picture. Changes then set keys. */
export function animate(): void {
  wish({ do: "frames", count: FRAMES });
  wish({ do: "switch", what: "auto-key", on: true });
}
