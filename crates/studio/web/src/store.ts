// The state of the page, as signals, and the connection that updates them. The page decides nothing: it sends requests to
// the server and shows the replies.

import { batch, computed, signal } from "@preact/signals";

import type { Send } from "./connection/listener";
import { open } from "#connection";
import type { ClientMessage, CommandTable, FileState, Ghost, Language, LineState, OutputState, State, ServerMessage, Tracks } from "./protocol";

export const connected = signal(true);
export const language = signal<Language | null>(null);
export const tables = signal<readonly CommandTable[]>([]);
/** The names of the example scenes. */
export const examples = signal<readonly string[]>([]);
/** Whether scripts can be added. */
export const canCreate = signal(false);
/** Whether the studio was started with a bucket. */
export const canSubmit = signal(false);
/** The names of the starter materials. */
export const presets = signal<readonly string[]>([]);
export const files = signal<readonly FileState[]>([]);
export const lines = signal<readonly LineState[]>([]);
export const state = signal<State | null>(null);
export const hovered = signal<number | null>(null);
export const outline = signal("");
export const guides = signal("");
export const hoverOutline = signal("");
export const ghosts = signal<readonly Ghost[]>([]);
export const tracks = signal<Tracks>({ tracks: [], more: false });
export const output = signal<OutputState | null>(null);
export const notice = signal("");
export const playing = signal(false);
/** Whether the search is open. */
export const searching = signal(false);
/** Whether the list of keys is open. */
export const help = signal(false);

let kept: readonly number[] = [];
/** The same array as long as the same lines are selected, so that what shows them is left alone. */
export const selection = computed(() => {
  const now = state.value?.selection ?? [];
  if (String(now) !== String(kept)) kept = now;
  return kept;
});
export const selected = computed(() => new Set(selection.value));
export const commands = computed(() => new Map(tables.value.map((table) => [table.name, table])));

/** Receives pictures as bytes with their header. */
type Show = (picture: ArrayBuffer) => void;

let send: Send | null = null;
let show: Show = () => {};
/** The messages that came before the editor. */
const early: ServerMessage[] = [];
let hearText: (tell: ServerMessage) => void = (tell) => void early.push(tell);
let hovering = false;
let nextHover: ClientMessage | null = null;
let nextDrag: ClientMessage | null = null;
/** The number of the last message about a drag. */
let dragged = 0;
let gestures = 0;
/** The number of messages sent. */
let sent = 0;
/** The last selection, and the number of messages sent up to it. */
let chosen: { readonly lines: readonly number[]; readonly sent: number } | null = null;

export function onPicture(take: Show): void {
  show = take;
}

export type Step = "undo" | "redo";

const stepAtOnce = (what: Step): void => ask({ ask: what });

/** Undoes or redoes a step. The editor does it after what was typed before. */
export let step: (what: Step) => void = stepAtOnce;

/** Receives each message after it has changed the state. The editor also says how a step is taken. */
export function onText(take: (tell: ServerMessage) => void, steps = stepAtOnce): void {
  hearText = take;
  step = steps;
  early.splice(0).forEach(take);
}

/** Returns the number of a new gesture. All changes with the same number are one undo step. */
export function gesture(): number {
  gestures += 1;
  return gestures;
}

/** Sends a message. Returns its number, or 0 without a connection. */
export function post(wish: ClientMessage): number {
  return send?.(JSON.stringify(wish)) ? (sent += 1) : 0;
}

export function ask(wish: ClientMessage): void {
  post(wish);
}

/** Drags what is held. While a reply is awaited, only the newest place is kept. */
export function drag(wish: ClientMessage): void {
  nextDrag = wish;
  if ((state.value?.asked ?? 0) >= dragged) dragNext();
}

/** Sends the place that was kept. */
export function dragNext(): void {
  const wish = nextDrag;
  nextDrag = null;
  if (!wish) return;
  ask(wish);
  dragged = sent;
}

/** Selects lines. The selection is shown at once, so that repeated keys continue from it. */
export function select(lines: readonly number[]): void {
  if (state.value) state.value = { ...state.value, selection: lines };
  ask({ ask: "select", lines });
  chosen = { lines, sent };
}

/** Requests the object under the pointer. While a reply is awaited, only the newest request is kept. */
export function hover(x: number, y: number): void {
  const wish: ClientMessage = { ask: "hover", x, y };
  if (hovering) {
    nextHover = wish;
  } else {
    hovering = true;
    ask(wish);
  }
}

export function connect(): void {
  send = open({
    opened: () => {
      connected.value = true;
      hovering = false;
      [sent, dragged] = [0, 0];
      dispatchEvent(new Event("resize"));
    },
    told: (text) => hear(JSON.parse(text) as ServerMessage),
    shown: (picture) => show(picture),
    closed: () => {
      connected.value = false;
      playing.value = false;
    },
  });
}

function hear(tell: ServerMessage): void {
  batch(() => {
    if (tell.language) language.value = tell.language;
    if (tell.tables) tables.value = tell.tables;
    if (tell.examples) examples.value = tell.examples;
    if (tell.canCreate !== undefined) canCreate.value = tell.canCreate;
    if (tell.canSubmit) canSubmit.value = true;
    if (tell.presets) presets.value = tell.presets;
    if (tell.files) files.value = tell.files;
    if (tell.lines) lines.value = tell.lines;
    if (tell.splices) {
      const all = lines.value.slice();
      for (const splice of tell.splices) all.splice(splice.at, splice.removed, ...splice.lines);
      lines.value = all;
    }
    hearText(tell);
    if (tell.state) {
      // A state that was sent before the server received the last selection does not undo it.
      const isOld = chosen !== null && tell.state.asked < chosen.sent;
      state.value = isOld && chosen ? { ...tell.state, selection: chosen.lines } : tell.state;
      if (tell.state.asked >= dragged) dragNext();
    }
    if (tell.hovered !== undefined) {
      hovered.value = tell.hovered;
      hovering = false;
      if (nextHover) {
        const wish = nextHover;
        nextHover = null;
        hovering = true;
        ask(wish);
      }
    }
    if (tell.outline !== undefined) outline.value = tell.outline;
    if (tell.guides !== undefined) guides.value = tell.guides;
    if (tell.hoverOutline !== undefined) hoverOutline.value = tell.hoverOutline;
    if (tell.ghosts) ghosts.value = tell.ghosts;
    if (tell.tracks) tracks.value = tell.tracks;
    if (tell.output) output.value = tell.output;
    // Without a clipboard, *Paste* of the timeline still has the keys.
    if (tell.clipboard) void navigator.clipboard.writeText(tell.clipboard).catch(() => undefined);
    if (tell.notice) notice.value = tell.notice;
  });
}
