// The values of tracks as curves: of those with a selected key, else of the selected line. A key is dragged to another
// frame and another value, and the tangents of a `bezier` by their ends. The wheel zooms into the values, with Shift it moves them, and a double click shows all again.

import { computed, signal } from "@preact/signals";
import type { JSX } from "preact";
import { useRef } from "preact/hooks";

import type { TimeState, Track } from "../protocol";
import { selected, tracks } from "../store";
import { chosenNames, chosenTracks, choose, dragKeys, grabKeys, keysOf, nameOf, place, releaseKeys, span, wish } from "./keys";

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

/** The least and the greatest value of some tracks, with a margin. `elastic` passes its key by 37 %. */
export function valuesOf(of: readonly Track[]): Range {
  const values = of.flatMap(({ keys }) => keys.map(([, value]) => value));
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const margin = (high - low) * (of.some(({ mode }) => mode === "elastic") ? 0.42 : 0.12) || Math.abs(high) * 0.5 || 1;
  return [low - margin, high + margin];
}

/** The lines of the tangents of a track, behind its selected key: from a key to its control point, and from the next one. */
export function tangentsOf({ keys, line, mode, number }: Track): readonly (readonly [number, number])[] {
  const [a, b, c, d] = mode.split(" ").slice(1).map(Number);
  const chosen = keys.findIndex(([frame]) => chosenNames.value.has(nameOf({ line, number, frame })));
  const [from, to] = keys.slice(Math.max(0, Math.min(chosen, keys.length - 2)));
  // Without a way between them there is nothing to ease.
  if (d === undefined || !from || !to || from[1] === to[1]) return [];
  const point = (x = 0, y = 0) => [from[0] + x * (to[0] - from[0]), from[1] + y * (to[1] - from[1])] as const;
  return [from, point(a, b), to, point(c, d)];
}

/** The steps to the right and up that an arrow key with Alt asks for. */
const STEPS: Readonly<Record<string, readonly [number, number]>> = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowRight: [1, 0], ArrowLeft: [-1, 0] };

interface PointProps {
  readonly left: number;
  /** In percent of the lane from its top. A point that is outside stays at the edge. */
  readonly top: number;
  readonly label: string;
  readonly isPressed?: boolean;
  readonly press: (event: PointerEvent) => void;
  readonly step: (along: number, up: number) => void;
}

/** What is dragged in the lane: a key, or the end of a tangent. */
function Point({ left, top, label, isPressed, press, step }: PointProps): JSX.Element {
  return (
    <button
      type="button"
      class={isPressed === undefined ? "key tangent" : "key"}
      style={{ left: `${left}%`, top: `${Math.max(0, Math.min(100, top))}%` }}
      aria-pressed={isPressed}
      aria-label={`${label}; Alt and arrow keys move it`}
      onPointerDown={(event) => {
        if (event.button > 0) return;
        event.stopPropagation();
        event.currentTarget.setPointerCapture(event.pointerId);
        press(event);
      }}
      onKeyDown={(event) => {
        const by = STEPS[event.key];
        if (!event.altKey || !by) return;
        event.preventDefault();
        event.stopPropagation();
        step(...by);
      }}
    >
      <span class="diamond" />
    </button>
  );
}

export function Curves({ time }: { readonly time: TimeState }): JSX.Element {
  const lane = useRef<HTMLDivElement>(null);
  // The values that the lane has shown since something is dragged, and what a move of the pointer does.
  const held = useRef<{ readonly range: Range; readonly move: (event: PointerEvent) => void } | null>(null);
  const all = shown.value;
  const of = all.map(({ line, number }) => `${line}:${number}`).join();
  const [low, high] = held.current?.range ?? (zoomed.value?.of === of ? zoomed.value.range : undefined) ?? valuesOf(all);
  const height = high - low;
  const topOf = (value: number): number => ((high - value) / height) * 100;
  /** The frames and values between two places in the window. */
  const between = (x: number, y: number): readonly [number, number] => {
    const box = lane.current?.getBoundingClientRect() ?? { width: 1, height: 1 };
    return [(x / box.width) * span(time), (-y / box.height) * height];
  };
  const grab = (start: PointerEvent, move: (along: number, up: number) => void): void => {
    held.current = { range: [low, high], move: (event) => move(...between(event.clientX - start.clientX, event.clientY - start.clientY)) };
    grabKeys();
  };
  const release = (): void => {
    if (held.current) releaseKeys();
    held.current = null;
  };
  const moveKeys = (along: number, up: number, digits = 3): void => dragKeys(Math.round(along), Number(up.toPrecision(digits)));
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
        <span>{all.length === 0 ? "Select a track." : all.map((track, at) => <u key={nameOf({ ...track, frame: 0 })} class={`curve-${at % 3}`}>{track.label} </u>)}</span>
        <span>{Number(low.toPrecision(3))}</span>
      </span>
      <div ref={lane} class="lane" onWheel={zoom} onDblClick={() => (zoomed.value = null)} onPointerMove={(event) => held.current?.move(event)} onPointerUp={release} onPointerCancel={release}>
        <svg viewBox={`${time.first - 0.5} 0 ${span(time)} 1`} preserveAspectRatio="none" aria-hidden="true">
          {all.map((track, at) => (
            <g key={nameOf({ ...track, frame: 0 })} class={`curve-${at % 3}`} transform={`matrix(1 0 0 ${-1 / height} 0 ${high / height})`}>
              <path d={track.path} />
              <path d={tangentsOf(track).map((point, at) => (at % 2 ? "L" : "M") + point).join("")} />
            </g>
          ))}
        </svg>
        <span class="head" style={{ left: `${place(time, time.number)}%` }} />
        {all.flatMap((track) => {
          const [from, first, to, second] = tangentsOf(track);
          if (!from || !first || !to || !second) return [];
          return [first, second].map(([x, y], end) => {
            const turn = (along: number, up: number): void => {
              const share = (by: number, axis: 0 | 1): number => by / (to[axis] - from[axis]);
              const words: (string | number)[] = track.mode.split(" ");
              const numbers = [Math.max(0, Math.min(1, share(x + along - from[0], 0))), share(y + up - from[1], 1)];
              words.splice(1 + 2 * end, 2, ...numbers.map((number) => Number(number.toFixed(3))));
              wish({ do: "ease", keys: [{ line: track.line, number: track.number, frame: from[0] }], mode: words.join(" "), cycle: track.cycle });
            };
            return (
              <Point
                key={`${nameOf({ ...track, frame: 0 })} ${end}`}
                left={place(time, x)}
                top={topOf(y)}
                label={`${track.label}, tangent ${end + 1}`}
                press={(event) => grab(event, turn)}
                step={(along, up) => turn(along / 4, (up * height) / 50)}
              />
            );
          });
        })}
        {all.flatMap((track) =>
          keysOf(track).map((key, at) => {
            const value = track.keys[at]?.[1] ?? 0;
            const top = topOf(value);
            const isChosen = chosenNames.value.has(nameOf(key));
            // A key that is dragged out of the lane stays held at its edge.
            return (
              key.frame >= time.first &&
              ((held.current && isChosen) || (top >= 0 && top <= 100)) && (
                <Point
                  key={nameOf(key)}
                  left={place(time, key.frame)}
                  top={top}
                  label={`${track.label}, frame ${key.frame}, value ${value}`}
                  isPressed={isChosen}
                  press={(event) => {
                    choose(key, event.shiftKey || event.ctrlKey);
                    grab(event, moveKeys);
                  }}
                  step={(along, up) => {
                    choose(key, false);
                    grabKeys();
                    moveKeys(along, (up * height) / 50, 2);
                    releaseKeys();
                  }}
                />
              )
            );
          }),
        )}
      </div>
    </div>
  );
}
