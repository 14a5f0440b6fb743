// The selected keys of the timeline, and the edits of them.

import { computed, signal } from "@preact/signals";

import type { KeyPlace, TimelineEdit, TimeState, Track } from "../protocol";
import { ask, state, tracks } from "../store";

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

/** The last frame of the lanes, which also show keys behind the last frame. */
export const end = computed((): number => {
  const frames = tracks.value.tracks.flatMap((track) => track.keys.map(([frame]) => frame));
  return Math.max(state.value?.time.last ?? 1, Math.ceil(frames.reduce((most, frame) => Math.max(most, frame), 1)));
});

/** The number of frames of the lanes. */
export const span = (time: TimeState): number => Math.max(1, end.value - time.first + 1);

/** Shares of a lane's width. */
export const place = (time: TimeState, frame: number): number => ((frame - time.first + 0.5) / span(time)) * 100;

export function choose(key: KeyPlace, extend: boolean): void {
  const name = nameOf(key);
  const isChosen = chosenNames.value.has(name);
  if (extend) chosenKeys.value = isChosen ? chosenKeys.value.filter((other) => nameOf(other) !== name) : [...chosenKeys.value, key];
  else if (!isChosen) chosenKeys.value = [key];
}

export function keysOf(track: Track): readonly KeyPlace[] {
  return track.keys.map(([frame]) => ({ line: track.line, number: track.number, frame }));
}

export function hasKeys(): boolean {
  const there = new Set(tracks.value.tracks.flatMap((track) => keysOf(track).map(nameOf)));
  return chosenKeys.value.some((key) => there.has(nameOf(key)));
}

export function wish(what: TimelineEdit): void {
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

export function ease(mode: string, cycle: boolean): void {
  wish({ do: "ease", keys: chosenKeys.value, mode, cycle });
}

export function grabKeys(): void {
  dragged.value = 0;
  wish({ do: "grab", keys: chosenKeys.value });
}

export function dragKeys(by: number, value = 0): void {
  if (by === dragged.value && value === 0) return;
  dragged.value = by;
  wish({ do: "move", by, value });
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
