// The picture with its handles. The server applies a drag; this file only sends the positions of
// the pointer.

import "./viewport.css";
import type { JSX } from "preact";
import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";

import { actions } from "../actions";
import { visible } from "../parts/visible";
import type { Handle } from "../protocol";
import { PICTURE_HEADER } from "../protocol";
import { ask, drag as dragTo, dragNext, ghosts, guides, hover, hovered, hoverOutline, lines, onPicture, outline, select, selected, state } from "../store";

type Point = readonly [number, number];

/** The distance by which an arrow key moves a handle, in pixels of the picture. */
const KEY_STEP = 8;

/** The zoom speed of the wheel. */
const WHEEL = 0.0012;

/** The milliseconds after the wheel's last turn until the picture is at rest. */
const REST = 160;

/** Pointer moves that are sent at once instead of once per frame, if the browser supports it, so that drags have less delay. */
const RAW = "onpointerrawupdate" in window;

/** The share of the picture's height by which an arrow key turns or moves the view. */
const VIEW_STEP = 0.04;

/** The zoom of a key. */
const ZOOM_STEP = 0.12;

/** The action of the pointer while its button is down. */
interface Hold {
  readonly what: "drag" | "pan" | "turn" | "box";
  last: Point;
  /** The position of the picture. Reading it at each move would force a new layout. */
  readonly box: DOMRect | undefined;
}

const ARROWS: Readonly<Record<string, Point>> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** The radius around a handle in which a finger takes it, in pixels of the window. */
const FINGER = 22;

/** Width and height of the panel, in the window's pixels. */
const room = signal<Point>([1, 1]);
/** The picture has fewer mirror images than the final one. */
const simplified = signal(false);

/** The rectangle of a box selection. */
const boxed = signal<readonly [number, number, number, number] | null>(null);

let resting = 0;

function rest(): void {
  clearTimeout(resting);
  resting = setTimeout(() => ask({ ask: "release" }), REST);
}

export function Viewport(): JSX.Element {
  const panel = useRef<HTMLDivElement>(null);
  const canvas = useRef<HTMLCanvasElement>(null);
  const held = useRef<Hold | null>(null);
  const raw = useRef<(event: PointerEvent) => void>(() => {});

  useEffect(() => {
    const element = panel.current;
    const context = canvas.current?.getContext("2d");
    if (!element || !context) return;
    const size = (): void => {
      const box = element.getBoundingClientRect();
      room.value = [box.width, box.height];
      const pixels = (length: number): number => Math.max(1, Math.round(length * devicePixelRatio));
      ask({ ask: "size", width: pixels(box.width), height: pixels(box.height) });
    };
    const moved = (event: Event): void => raw.current(event as PointerEvent);
    element.addEventListener("pointerrawupdate", moved);
    const observer = new ResizeObserver(size);
    observer.observe(element);
    addEventListener("resize", size);
    onPicture((picture) => {
      const head = new DataView(picture, 0, PICTURE_HEADER);
      const field = (at: number): number => head.getUint32(4 * at, true);
      const [number, width, height, quality] = [field(0), field(1), field(2), field(4)];
      const [left, top, across, down] = [field(5), field(6), field(7), field(8)];
      const target = context.canvas;
      if (target.width !== width || target.height !== height) [target.width, target.height] = [width, height];
      // If the picture is unchanged, no pixels follow.
      if (across > 0) context.putImageData(new ImageData(new Uint8ClampedArray(picture, PICTURE_HEADER), across, down), left, top);
      ask({ ask: "shown" });
      target.dataset["picture"] = String(number);
      target.dataset["final"] = String(quality === 1);
      simplified.value = quality === 2;
      target.dispatchEvent(new CustomEvent("picture", { detail: number }));
    });
    return () => {
      element.removeEventListener("pointerrawupdate", moved);
      observer.disconnect();
      removeEventListener("resize", size);
    };
  }, []);

  const now = state.value;
  const picture = now?.picture ?? null;
  const [, width, height] = picture ?? [0, 1, 1];
  const at = (event: MouseEvent): Point => {
    const box = held.current?.box ?? canvas.current?.getBoundingClientRect();
    if (!box) return [0, 0];
    return [((event.clientX - box.left) / box.width) * width, ((event.clientY - box.top) / box.height) * height];
  };

  const press = (event: PointerEvent, handle: Handle | null): void => {
    if (event.button > 2) return;
    event.stopPropagation();
    event.preventDefault();
    panel.current?.setPointerCapture(event.pointerId);
    panel.current?.focus({ preventScroll: true });
    const [x, y] = at(event);
    const box = canvas.current?.getBoundingClientRect();
    const looks = event.button === 1 || event.altKey;
    const isBox = event.shiftKey && (event.ctrlKey || event.metaKey);
    const what = isBox ? "box" : event.button === 2 || (looks && event.shiftKey) ? "pan" : looks ? "turn" : "drag";
    held.current = { what, last: [x, y], box };
    if (isBox) boxed.value = [x, y, x, y];
    if (what !== "drag") return;
    const extend = event.shiftKey;
    // Where handles are close together, the nearest is meant.
    const off = (of: Handle): number => Math.hypot(of.at[0] - x, of.at[1] - y);
    const meant = handle && (state.value?.handles ?? []).reduce((best, other) => (off(other) < off(best) ? other : best), handle);
    ask({ ask: "press", x, y, extend, grip: meant?.grip ?? null, line: meant?.line ?? null });
  };
  const drag = (event: PointerEvent): void => {
    if (held.current?.what !== "drag") return;
    const [x, y] = at(event);
    dragTo({ ask: "drag", x, y, upright: event.shiftKey, snap: event.ctrlKey || event.metaKey, whole: event.altKey });
  };
  raw.current = drag;
  const move = (event: PointerEvent): void => {
    const [x, y] = at(event);
    const holding = held.current;
    if (!holding) {
      hover(x, y);
    } else if (holding.what === "box") {
      boxed.value = [...holding.last, x, y];
    } else if (holding.what === "drag") {
      if (!RAW) drag(event);
    } else {
      const [left, top] = holding.last;
      holding.last = [x, y];
      ask({ ask: "navigate", how: holding.what, x: (x - left) / height, y: (y - top) / height });
    }
  };
  /** Gives up a drag, and turns, moves and zooms the view. */
  const keyDown = (event: KeyboardEvent): void => {
    const way = ARROWS[event.key];
    const zoom = { "+": -1, "=": -1, "-": 1 }[event.key];
    if (way && event.altKey) {
      ask({ ask: "navigate", how: event.shiftKey ? "pan" : "turn", x: way[0] * VIEW_STEP, y: way[1] * VIEW_STEP });
    } else if (zoom && !event.ctrlKey && !event.metaKey) ask({ ask: "navigate", how: "zoom", x: 0, y: zoom * ZOOM_STEP });
    else if (event.key === "Escape" && held.current?.what === "drag") {
      ask({ ask: "give-up", gesture: null });
      held.current = null;
    } else return;
    event.preventDefault();
    event.stopPropagation();
    if (event.key !== "Escape") rest();
  };
  const release = (): void => {
    const rectangle = boxed.value;
    dragNext();
    if (rectangle) ask({ ask: "box", from: [rectangle[0], rectangle[1]], to: [rectangle[2], rectangle[3]], extend: false });
    else if (held.current) ask({ ask: "release" });
    boxed.value = null;
    held.current = null;
    // The outline belonged to the previous object.
    hoverOutline.value = "";
  };
  const keyed = (event: KeyboardEvent, handle: Handle): void => {
    const way = ARROWS[event.key];
    if (!way || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    const [x, y] = handle.at;
    ask({ ask: "press", x, y, extend: false, grip: handle.grip, line: handle.line });
    ask({ ask: "drag", x: x + way[0] * KEY_STEP, y: y + way[1] * KEY_STEP, upright: event.shiftKey, snap: event.ctrlKey, whole: event.altKey });
    ask({ ask: "release" });
  };

  // Pictures of an orthographic camera have the script's size, which may not fit the panel.
  const scale = Math.min(1 / devicePixelRatio, room.value[0] / width, room.value[1] / height);
  const shown = { width: `${width * scale}px`, height: `${height * scale}px` };
  const under = hovered.value === null ? null : (lines.value[hovered.value] ?? null);
  return (
    <div
      ref={panel}
      class={under ? "viewport over" : "viewport"}
      tabIndex={0}
      role="application"
      aria-label="Viewport: drag objects to move them, drag the background to rotate the view"
      onPointerDown={(event) => press(event, null)}
      onKeyDown={keyDown}
      onPointerMove={move}
      onPointerUp={release}
      onPointerCancel={release}
      onPointerLeave={() => (hovered.value = null)}
      onContextMenu={(event) => event.preventDefault()}
      onWheel={(event) => {
        event.preventDefault();
        ask({ ask: "navigate", how: "zoom", x: 0, y: event.deltaY * WHEEL });
        rest();
      }}
      onDragOver={(event) => {
        event.preventDefault();
        hover(...at(event));
      }}
      onDrop={(event) => {
        event.preventDefault();
        drop(event.dataTransfer?.getData("text/plain") ?? "", at(event));
      }}
    >
      <div class={picture ? "stage" : "stage empty"} style={shown}>
        <canvas ref={canvas} style={shown} data-wanted={picture?.[0]} />
        <svg viewBox={`0 0 ${width} ${height}`} style={shown} aria-hidden={picture ? "false" : "true"}>
          {now?.grid && <path class="grid" d={now.grid} />}
          {ghosts.value.map((ghost) => (
            <path key={ghost.after} class={`ghost ${ghost.after < 0 ? "before" : "after"} far${Math.abs(ghost.after)}`} d={ghost.path} />
          ))}
          {under && !held.current && <path class="outline under-pointer" d={hoverOutline.value} />}
          <path class="outline" d={outline.value} />
          <path class="guides" d={guides.value} />
          {now?.frustum && (
            <path
              class={now.camera !== null && selected.value.has(now.camera) ? "frustum chosen" : "frustum"}
              d={now.frustum}
              onPointerDown={(event) => {
                event.stopPropagation();
                if (now.camera !== null) select([now.camera]);
              }}
            />
          )}
          {now?.way && <path class="way" d={now.way} />}
          {now?.marks && <path class="marks" d={now.marks} />}
          {boxed.value && <path class="outline under-pointer" d={boxPath(boxed.value)} />}
          {picture && now?.handles.map((handle) => <HandleShape key={key(handle)} handle={handle} unit={1 / scale} press={press} keyed={keyed} />)}
        </svg>
      </div>
      {now && picture && <ViewCube axes={now.axes} />}
      {simplified.value && <p class="under simple">Mirrors and glass are simplified while this moves.</p>}
      {now && !picture && <p class="hint">{lines.value.some(({ text }) => text.trim()) ? "There is no picture yet: see the errors of the script." : "The scene is empty: drag a shape in from the left, or click one."}</p>}
      {under && !held.current && !selected.value.has(hovered.value ?? -1) && (
        <p class="under">{visible(under.name ?? under.subject ?? under.command ?? "")}</p>
      )}
    </div>
  );
}

const boxPath = ([left, top, right, bottom]: readonly [number, number, number, number]): string => `M${left} ${top}H${right}V${bottom}H${left}Z`;

/** The axes as they are seen, each a button that looks along it. */
function ViewCube({ axes }: { readonly axes: readonly (readonly [number, number])[] }): JSX.Element {
  const looks = [actions.lookSide, actions.lookTop, actions.lookFront];
  return (
    <svg class="cube" viewBox="-40 -40 80 80" role="group" aria-label="Axes">
      {[-1, 1].map((end) =>
        axes.map(([x, y], axis) => {
          const action = looks[axis];
          const name = "xyz"[axis] ?? "";
          if (!action) return null;
          // Of an axis that is looked along, a click shows the other side.
          const isEndOn = Math.hypot(x, y) < 0.01;
          const run = (): void => {
            if (!isEndOn) action.run();
            if (end < 0 || isEndOn) actions.lookBack.run();
          };
          const title = end < 0 ? `${action.title}, then ${actions.lookBack.title.toLowerCase()}` : action.title;
          const [to, up] = [28 * end * x, 28 * end * y];
          return (
            <g key={`${name}${end}`} class={`axis-${name}`} role="button" tabindex={0} aria-label={`${title}, along ${name}`} onPointerDown={(event) => event.stopPropagation()} onClick={run} onKeyDown={(event) => event.key === "Enter" && run()}>
              <title>{title}</title>
              {end < 0 && <line x1={-to} y1={-up} x2={to} y2={up} />}
              <circle cx={to} cy={up} r={end < 0 ? 5 : 9} />
              {end > 0 && <text x={to} y={up}>{name}</text>}
            </g>
          );
        }),
      )}
    </svg>
  );
}

/** What is dragged into the picture: a command, or a material for the object that it is dropped on. */
function drop(what: string, at: Point): void {
  const [, kind, material] = /^(Material|Preset) (.+)$/.exec(what) ?? [];
  if (material) ask({ ask: "paint", at, material, preset: kind === "Preset" });
  else if (what) ask({ ask: "add", command: what, at });
}

function key(handle: Handle): string {
  return JSON.stringify([handle.grip, handle.line]);
}

interface HandleProps {
  readonly handle: Handle;
  /** A pixel of the window, in pixels of the picture. */
  readonly unit: number;
  readonly press: (event: PointerEvent, handle: Handle) => void;
  readonly keyed: (event: KeyboardEvent, handle: Handle) => void;
}

/**
 * The shapes of handles, in pixels: arrows move, squares move along a plane or scale, bars are lengths, keys have the shape
 * that they have in the timeline, and the others are round.
 */
const ROUND = "M-6 0a6 6 0 1 0 12 0a6 6 0 1 0-12 0";
const SQUARE = "M-5-5H5V5H-5Z";
const SHAPES: Readonly<Record<string, string>> = { axis: "M10 0-6 7V-7Z", plane: SQUARE, scale: SQUARE, size: SQUARE, length: "M-3-7H3V7H-3Z", key: "M0-8 8 0 0 8-8 0Z" };

function HandleShape({ handle, unit, press, keyed }: HandleProps): JSX.Element {
  const { grip, at, from, label, way } = handle;
  // An arrow has the direction of its line, and a bar lies across it.
  const turned = grip.what === "axis" || grip.what === "length" ? ` rotate(${(Math.atan2(at[1] - from[1], at[0] - from[0]) * 180) / Math.PI})` : "";
  const which = "axis" in grip ? `${grip.what}-${"xyz"[grip.axis] ?? ""}` : grip.what;
  return (
    <g
      class={`handle ${which}`}
      tabindex={0}
      role="button"
      aria-label={`${label}; arrow keys move it`}
      data-grip={which}
      onPointerDown={(event) => press(event, handle)}
      onKeyDown={(event) => keyed(event, handle)}
    >
      <title>{label}</title>
      {way && <path class="ring" d={way} />}
      <line x1={from[0]} y1={from[1]} x2={at[0]} y2={at[1]} />
      <circle class="reach" cx={at[0]} cy={at[1]} r={FINGER * unit} />
      <path class="dot" transform={`translate(${at}) scale(${unit})${turned}`} d={SHAPES[grip.what] ?? ROUND} />
    </g>
  );
}
