// Frames and keys: the player, and a track for each number that changes. The server edits keys; this file only handles
// their selection and the pointer.

import "./timeline.css";
import { ChartSpline, Pause, Play, Repeat, Repeat1 } from "lucide";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { actions } from "../actions";
import { Button } from "../parts/button";
import { Icon } from "../parts/icon";
import { List } from "../parts/list";
import { NumberField } from "../parts/number";
import { visible } from "../parts/visible";
import type { KeyPlace, LineState, TimeState, Track } from "../protocol";
import { ask, canCreate, files, language, lines, playing, select, selected, selection, state, tracks } from "../store";
import { Curves, curving } from "./curves";
import { chosenKeys, chosenNames, chosenTracks, choose, dragKeys, end, ease, grabKeys, keysOf, looping, nameOf, place, releaseKeys, removeKeys, span, wish } from "./keys";

const ROW = 26;
/** The number of visible rows. */
const SEEN = 6;

export function Timeline(): JSX.Element | null {
  const now = state.value;
  usePlayer(now?.fps ?? 10);
  if (!now) return null;
  return (
    <section class="panel timeline" aria-label="Timeline">
      <div class={now.frames > 1 ? "transport film" : "transport"}>
        {now.frames > 1 && <Player frame={now.frame} frames={now.frames} fps={now.fps} />}
        <Tools time={now.time} frames={now.frames} />
      </div>
      {tracks.value.tracks.length > 0 && <Tracks time={now.time} />}
      {tracks.value.more && <p class="note">There are more numbers that change; see the script.</p>}
    </section>
  );
}

/** Shows frames at the frame rate during playback. */
function usePlayer(fps: number): void {
  const isPlaying = playing.value;
  useEffect(() => {
    if (!isPlaying) return;
    const begin = performance.now();
    const now = state.value;
    const count = now?.frames ?? 1;
    // At the end it starts again.
    const from = now && now.frame + 1 < count ? now.frame : 0;
    let shown = from;
    let timer = 0;
    const tick = (): void => {
      const passed = from + Math.floor(((performance.now() - begin) / 1000) * fps);
      const isOver = !looping.peek() && passed >= count;
      const frame = isOver ? count - 1 : passed % count;
      if (frame !== shown) {
        shown = frame;
        ask({ ask: "frame", frame, moving: true });
      }
      if (isOver) playing.value = false;
      else timer = requestAnimationFrame(tick);
    };
    timer = requestAnimationFrame(tick);
    return () => {
      cancelAnimationFrame(timer);
      ask({ ask: "frame", frame: shown, moving: false });
    };
  }, [isPlaying, fps]);
}

function Player({ frame, frames, fps }: { readonly frame: number; readonly frames: number; readonly fps: number }): JSX.Element {
  return (
    <div class="player" role="group" aria-label="Frames">
      <Button action={actions.previous} label="Previous" />
      <Button action={{ ...actions.play, icon: playing.value ? Pause : Play }} label={playing.value ? "Stop" : "Play"} />
      <Button action={actions.next} label="Next" />
      <button
        type="button"
        class="icon-button"
        aria-label="Loop"
        aria-pressed={looping.value}
        onClick={() => (looping.value = !looping.value)}
        title="Start again at the end"
      >
        <Icon of={Repeat} />
      </button>
      <input
        type="range"
        aria-label="Frame"
        min={1}
        max={frames}
        value={frame + 1}
        onInput={(event) => ask({ ask: "frame", frame: event.currentTarget.valueAsNumber - 1, moving: true })}
        onChange={(event) => ask({ ask: "frame", frame: event.currentTarget.valueAsNumber - 1, moving: false })}
      />
      <output>
        <span>frame </span>
        {frame + 1} of {frames}
      </output>
      <label class="fps" title={canCreate.value ? "Stored in animation.json" : "As long as the studio runs; rayfold render takes it as --fps"}>
        <NumberField label="Frames a second" value={fps} least={0.01} most={1000} set={(asked) => wish({ do: "pace", fps: asked })} /> <span>fps</span>
      </label>
    </div>
  );
}

function Tools({ time, frames }: { readonly time: TimeState; readonly frames: number }): JSX.Element {
  // A folder of single pictures has no keys: each is a script of its own.
  const isOne = files.value.length < 2 || time.first !== time.last || tracks.value.tracks.length > 0;
  const count = time.last - time.first + 1;
  if (frames < 2) {
    return (
      <div class="tools">
        <Button action={actions.animate} label="Animate" wide />
        <span class="note">This is a single picture. In an animation, an object that you drag at a later frame moves there.</span>
      </div>
    );
  }
  return (
    <div class="tools" role="group" aria-label="Keys">
      {isOne && (
        <label title="The number of frames">
          <NumberField label="Frames" value={count} least={1} most={1_000_000} whole set={(asked) => wish({ do: "frames", count: asked })} /> <span>frames</span>
        </label>
      )}
      {isOne ? (
        <>
          <Button action={actions.autoKey} label="Auto-key" pressed={time.autoKey} wide />
          <Button action={actions.path} label="Path" pressed={time.path} />
          <Button action={actions.onion} label="Onion skin" pressed={time.onion} />
        </>
      ) : (
        <span class="note">Keys need one script with many frames.</span>
      )}
      {tracks.value.tracks.length > 0 && <Button action={actions.pasteKeys} label={time.copied > 0 ? `Paste ${time.copied}` : "Paste"} />}
    </div>
  );
}

/** The tools for the selected keys. */
function Chosen({ chosen }: { readonly chosen: readonly Track[] }): JSX.Element {
  const [first] = chosen;
  const mode = first && chosen.every((track) => track.mode === first.mode) ? first.mode : "";
  const cycle = chosen.length > 0 && chosen.every((track) => track.cycle);
  const none = chosen.length === 0;
  return (
    <div class="chosen-keys" role="group" aria-label="Selected keys">
        <select aria-label="Easing" title="How the number moves between its keys" value={mode} disabled={none} onChange={(event) => ease(event.currentTarget.value, cycle)}>
          {mode === "" && <option value="">{none ? "easing" : "several"}</option>}
          {language.value?.curve_modes.map(
            ({ name, about }) =>
              name !== "cycle" && (
                <option key={name} value={mode.split(" ")[0] === name ? mode : name} title={about}>
                  {name}
                </option>
              ),
          )}
        </select>
      <button
        type="button"
        class="icon-button"
        aria-label="Repeat"
        aria-pressed={cycle}
        disabled={none}
        title="Start again at the last key"
        onClick={() => ease(mode || "linear", !cycle)}
      >
        <Icon of={Repeat1} />
      </button>
      <button type="button" class="icon-button" aria-label="Curves" aria-pressed={curving.value} title="Show the values as curves" onClick={() => (curving.value = !curving.value)}>
        <Icon of={ChartSpline} />
      </button>
      <Button action={actions.copyKeys} label="Copy keys" />
      <Button action={actions.removeKeys} label="Delete keys" />
    </div>
  );
}

function Tracks({ time }: { readonly time: TimeState }): JSX.Element {
  const all = tracks.value.tracks;
  const held = useRef<{ readonly x: number; readonly width: number } | null>(null);
  const main = selection.value.at(-1) ?? null;
  const revealed = main === null ? -1 : all.findIndex((track) => track.line === main);

  const press = (event: PointerEvent, key: KeyPlace): void => {
    const lane = (event.currentTarget as HTMLElement).parentElement;
    const panel = lane?.closest<HTMLElement>(".tracks");
    if (event.button > 0 || !lane || !panel) return;
    event.stopPropagation();
    choose(key, event.shiftKey || event.ctrlKey);
    panel.setPointerCapture(event.pointerId);
    held.current = { x: event.clientX, width: lane.clientWidth / span(time) };
    grabKeys();
  };
  const move = (event: PointerEvent): void => {
    if (held.current) dragKeys(Math.round((event.clientX - held.current.x) / held.current.width));
  };
  const release = (): void => {
    if (held.current) releaseKeys();
    held.current = null;
  };
  const scrub = (event: PointerEvent, moving: boolean): void => {
    const lane = event.currentTarget as HTMLElement;
    if (event.buttons !== 1 && moving) return;
    const box = lane.getBoundingClientRect();
    const share = Math.max(0, Math.min(1 - 1e-9, (event.clientX - box.left) / box.width));
    const frame = Math.min(Math.floor(share * span(time)), time.last - time.first);
    ask({ ask: "frame", frame: time.start + frame, moving });
  };
  return (
    <div class="tracks" onPointerMove={move} onPointerUp={release} onPointerCancel={release}>
      <div class="track ruler">
        <Chosen chosen={chosenTracks.value} />
        <div
          class="lane"
          aria-hidden="true"
          onPointerDown={(event) => {
            event.currentTarget.setPointerCapture(event.pointerId);
            chosenKeys.value = [];
            scrub(event, true);
          }}
          onPointerMove={(event) => scrub(event, true)}
          onPointerUp={(event) => scrub(event, false)}
        >
          <Head time={time} />
          {ticks(time).map((frame) => (
            <span key={frame} class="tick" style={{ left: `${place(time, frame)}%` }}>
              {frame}
            </span>
          ))}
        </div>
      </div>
      <List class="list" style={{ height: `${Math.min(SEEN, all.length) * ROW}px` }} count={all.length} height={ROW} reveal={revealed < 0 ? null : revealed} role="group" aria-label="Tracks">
        {(row) => {
          const track = all[row];
          return track ? <Row row={row} track={track} line={lines.value[track.line]} time={time} press={press} /> : null;
        }}
      </List>
      {curving.value && <Curves time={time} />}
    </div>
  );
}

function Head({ time }: { readonly time: TimeState }): JSX.Element {
  return <span class="head" style={{ left: `${place(time, time.number)}%` }} />;
}

/** The frames that the ruler labels: at most about ten. */
function ticks(time: TimeState): readonly number[] {
  const count = span(time);
  const steps = [1, 2, 5, 10, 20, 25, 50, 100, 200, 500, 1000, 10_000, 100_000];
  const every = steps.find((size) => count / size <= 10) ?? 1_000_000;
  const frames = [time.first];
  for (let frame = Math.ceil((time.first + 0.6 * every) / every) * every; frame <= end.value; frame += every) frames.push(frame);
  return frames;
}

interface RowProps {
  readonly row: number;
  readonly track: Track;
  readonly line: LineState | undefined;
  readonly time: TimeState;
  readonly press: (event: PointerEvent, key: KeyPlace) => void;
}

function Row({ row, track, line, time, press }: RowProps): JSX.Element {
  const name = visible(line?.name ?? line?.subject ?? `${line?.command ?? ""} in line ${track.line + 1}`);
  const keys = keysOf(track);
  const names = chosenNames.value;
  // One key of a track is reached by Tab, the others from there by the arrow keys.
  const reached = Math.max(0, keys.findIndex((key) => names.has(nameOf(key))));
  return (
    <div class={selected.value.has(track.line) ? "track selected" : "track"}>
      <button
        type="button"
        class="label"
        title={`${name}, ${track.label}: select it, and all its keys`}
        onClick={(event) => {
          select([track.line]);
          chosenKeys.value = event.shiftKey ? [...chosenKeys.value, ...keys] : keys;
        }}
      >
        <b>{name}</b> {track.label}
      </button>
      <div class="lane">
        <Behind time={time} />
        <Head time={time} />
        {keys.map((key, at) =>
          key.frame < time.first ? null : (
            <button
              type="button"
              key={at}
              class="key"
              data-row={row}
              style={{ left: `${place(time, key.frame)}%` }}
              tabIndex={at === reached ? 0 : -1}
              aria-pressed={names.has(nameOf(key))}
              aria-label={`Key of ${name}, ${track.label}, at frame ${key.frame}: ${track.keys[at]?.[1] ?? 0}`}
              onPointerDown={(event) => press(event, key)}
              onClick={(event) => {
                // By the keyboard. With the pointer, the key is selected already.
                if (event.detail === 0) chosenKeys.value = [key];
              }}
              onKeyDown={(event) => keyed(event, keys, at)}
            >
              <span class="diamond" />
            </button>
          ),
        )}
      </div>
    </div>
  );
}

/** The part of a lane behind the last frame. */
function Behind({ time }: { readonly time: TimeState }): JSX.Element | null {
  const from = ((time.last - time.first + 1) / span(time)) * 100;
  return from < 100 ? <span class="behind" style={{ left: `${from}%` }} /> : null;
}

/** Handles the keyboard: goes to other keys, and selects, moves and deletes keys. */
function keyed(event: KeyboardEvent & { readonly currentTarget: HTMLElement }, keys: readonly KeyPlace[], at: number): void {
  const control = event.ctrlKey || event.metaKey;
  const element = event.currentTarget;
  const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  const over = { ArrowUp: -1, ArrowDown: 1 }[event.key];
  const key = keys[at];
  if (!key) return;
  if (way && event.altKey) {
    if (!chosenNames.value.has(nameOf(key))) chosenKeys.value = [key];
    grabKeys();
    dragKeys(way * (event.shiftKey ? 10 : 1));
    releaseKeys();
  } else if (way) {
    const next = keys[at + way];
    const sibling = way < 0 ? element.previousElementSibling : element.nextElementSibling;
    if (next) chosenKeys.value = event.shiftKey ? [...chosenKeys.value, next] : [next];
    if (sibling instanceof HTMLButtonElement) sibling.focus();
  } else if (over) {
    const row = Number(element.dataset["row"]) + over;
    const other = element.closest(".tracks")?.querySelector<HTMLElement>(`.key[data-row="${row}"][tabindex="0"]`);
    other?.focus();
  } else if (control && event.key === "a") {
    chosenKeys.value = tracks.value.tracks.flatMap(keysOf);
  } else if (event.key === "Delete" || event.key === "Backspace") {
    if (!chosenNames.value.has(nameOf(key))) chosenKeys.value = [key];
    removeKeys();
  } else return;
  event.preventDefault();
  event.stopPropagation();
}
