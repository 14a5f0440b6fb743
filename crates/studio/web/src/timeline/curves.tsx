// The values of tracks as curves: of those with a selected key, else of the selected line. A key is dragged to another
// frame and another value. The wheel zooms into the values, with Shift it moves them, and a double click shows all again.

import { computed, signal } from "@preact/signals";
import type { JSX } from "preact";
import { useRef } from "preact/hooks";

import type { KeyPlace, TimeState, Track } from "../protocol";
import { selected, tracks } from "../store";
import { chosenNames, chosenTracks, choose, dragKeys, grabKeys, keysOf, nameOf, place, releaseKeys, span } from "./keys";

/** Whether the curves are shown. */
export const curving = signal(false);

type Range = readonly [number, number];

/** The zoomed values of some tracks; `null` for all. */
const zoomed = signal<{ readonly of: string; readonly range: Range } | null>(null);

/** The most curves that are shown at once. */
const SHOWN = 9;

const shown = computed((): readonly Track[] => {
  const chosen = chosenTracks.value;
  return (chosen.length > 0 ? chosen : tracks.value.tracks.filter(({ line }) => selected.value.has(line))).slice(0, SHOWN);
});

/** The least and the greatest value of some tracks, with a margin. */
export function valuesOf(of: readonly Track[]): Range {
  const values = of.flatMap(({ keys }) => keys.map(([, value]) => value));
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const margin = (high - low) * 0.12 || Math.abs(high) * 0.5 || 1;
  return [low - margin, high + margin];
}

/** A track as an SVG path of frames and values. A smooth piece is a cubic with the slopes at its ends. */
export function pathOf({ keys, mode, slopes }: Track): string {
  return keys
    .map(([x, y], at) => {
      const before = keys[at - 1];
      if (!before) return `M${x} ${y}`;
      const third = (x - before[0]) / 3;
      if (mode === "step") return `H${x}V${y}`;
      if (mode !== "smooth") return `L${x} ${y}`;
      return `C${before[0] + third} ${before[1] + third * (slopes[at - 1] ?? 0)} ${x - third} ${y - third * (slopes[at] ?? 0)} ${x} ${y}`;
    })
    .join("");
}

export function Curves({ time }: { readonly time: TimeState }): JSX.Element {
  const held = useRef<{ readonly x: number; readonly y: number; readonly frame: number; readonly value: number; readonly range: Range } | null>(null);
  const all = shown.value;
  const of = all.map(({ line, number }) => `${line}:${number}`).join();
  const [low, high] = held.current?.range ?? (zoomed.value?.of === of ? zoomed.value.range : undefined) ?? valuesOf(all);
  const height = high - low;
  const press = (event: PointerEvent, key: KeyPlace): void => {
    const box = (event.currentTarget as HTMLElement).parentElement?.getBoundingClientRect();
    if (!box || event.button > 0) return;
    event.stopPropagation();
    choose(key, event.shiftKey || event.ctrlKey);
    (event.currentTarget as HTMLElement).setPointerCapture(event.pointerId);
    held.current = { x: event.clientX, y: event.clientY, frame: box.width / span(time), value: height / box.height, range: [low, high] };
    grabKeys();
  };
  const move = (event: PointerEvent): void => {
    const start = held.current;
    if (start) dragKeys(Math.round((event.clientX - start.x) / start.frame), Number(((start.y - event.clientY) * start.value).toPrecision(3)));
  };
  const release = (): void => {
    if (held.current) releaseKeys();
    held.current = null;
  };
  const zoom = (event: WheelEvent & { readonly currentTarget: HTMLElement }): void => {
    event.preventDefault();
    const box = event.currentTarget.getBoundingClientRect();
    const at = high - ((event.clientY - box.top) / box.height) * height;
    // With Shift, a wheel turns sideways in some browsers.
    const by = event.shiftKey ? ((event.deltaY || event.deltaX) / box.height) * height : 0;
    const factor = event.shiftKey ? 1 : Math.exp(event.deltaY * 0.002);
    zoomed.value = { of, range: [at - (at - low) * factor - by, at + (high - at) * factor - by] };
  };
  return (
    <div class="curves track">
      <span class="label note">
        <span>{Number(high.toPrecision(3))}</span>
        <span>{all.length === 0 ? "Select a track." : all.map(({ label }) => label).join(", ")}</span>
        <span>{Number(low.toPrecision(3))}</span>
      </span>
      <div class="lane" onWheel={zoom} onDblClick={() => (zoomed.value = null)} onPointerMove={move} onPointerUp={release} onPointerCancel={release}>
        <svg viewBox={`${time.first - 0.5} 0 ${span(time)} 1`} preserveAspectRatio="none" aria-hidden="true">
          {all.map((track, at) => (
            <path key={nameOf({ ...track, frame: 0 })} class={`curve-${at % 3}`} d={pathOf(track)} transform={`matrix(1 0 0 ${-1 / height} 0 ${high / height})`} />
          ))}
        </svg>
        <span class="head" style={{ left: `${place(time, time.number)}%` }} />
        {all.flatMap((track) =>
          keysOf(track).map((key, at) => {
            const top = ((high - (track.keys[at]?.[1] ?? 0)) / height) * 100;
            // A key that is dragged out of the lane stays held at its edge.
            const isHeld = held.current !== null && chosenNames.value.has(nameOf(key));
            return (
              key.frame >= time.first &&
              (isHeld || (top >= 0 && top <= 100)) && (
                <button
                  type="button"
                  key={nameOf(key)}
                  class="key"
                  style={{ left: `${place(time, key.frame)}%`, top: `${Math.max(0, Math.min(100, top))}%` }}
                  aria-pressed={chosenNames.value.has(nameOf(key))}
                  aria-label={`${track.label}, frame ${key.frame}, value ${track.keys[at]?.[1] ?? 0}; Alt and arrow keys move it`}
                  onPointerDown={(event) => press(event, key)}
                  onKeyDown={(event) => {
                    const over = { ArrowUp: 1, ArrowDown: -1 }[event.key] ?? 0;
                    const along = { ArrowRight: 1, ArrowLeft: -1 }[event.key] ?? 0;
                    if (!event.altKey || (!over && !along)) return;
                    event.preventDefault();
                    event.stopPropagation();
                    choose(key, false);
                    grabKeys();
                    dragKeys(along, Number(((over * height) / 50).toPrecision(2)));
                    releaseKeys();
                  }}
                >
                  <span class="diamond" />
                </button>
              )
            );
          }),
        )}
      </div>
    </div>
  );
}
