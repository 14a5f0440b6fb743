// The actions of keys and buttons: for each its keys, its title, and the request to the server.

import {
  ArrowDown, ArrowDownToLine, ArrowUp, Camera, ClipboardPaste, Copy, EyeOff, Film, Focus, Group, Keyboard, KeyRound, Layers, Lock, MapPin, Play,
  Redo2, Search, Spline, StepBack, StepForward, Trash2, Undo2, Ungroup, Video, Zap, type IconNode,
} from "lucide";

import { ask, connected, help, lines, playing, searching, selection, state, step } from "./store";
import { animate, chosenKeys, copyKeys, hasKeys, pasteKeys, removeKeys, wish } from "./timeline/keys";

export interface Action {
  readonly title: string;
  /** As `KeyboardEvent.key`, with `Ctrl+` (or the command key) and `Shift+` before it. */
  readonly keys: readonly string[];
  readonly icon?: IconNode;
  readonly run: () => void;
  readonly enabled?: () => boolean;
  /** Whether its keys are for keys of the timeline, and those of objects come first elsewhere. */
  readonly ofKeys?: boolean;
}

const any = (): boolean => selection.value.length > 0;
const one = (): boolean => selection.value.length === 1;
const reorder = (down: boolean) => (): void => ask({ ask: "reorder", line: selection.value.at(-1) ?? -1, down });
const nudge = (x: number, y: number, z: number) => (): void =>
  ask({ ask: "nudge", lines: selection.value, by: [x, y, z] });

export function goBy(by: number): void {
  const now = state.value;
  if (now) ask({ ask: "frame", frame: (now.frame + by + now.frames) % now.frames, moving: false });
}

export const actions = {
  undo: { title: "Undo", keys: ["Ctrl+z"], icon: Undo2, run: () => step("undo"), enabled: () => state.value?.canUndo ?? false },
  redo: {
    title: "Redo",
    keys: ["Ctrl+Shift+Z", "Ctrl+y"], icon: Redo2,
    run: () => step("redo"),
    enabled: () => state.value?.canRedo ?? false,
  },
  duplicate: {
    title: "Duplicate",
    keys: ["Ctrl+d"], icon: Copy,
    run: () => ask({ ask: "duplicate", lines: selection.value }),
    enabled: any,
  },
  removeKeys: { title: "Delete the selected keys, in the timeline", keys: ["Delete", "Backspace"], icon: Trash2, run: removeKeys, enabled: hasKeys, ofKeys: true },
  remove: { title: "Delete", keys: ["Delete", "Backspace"], icon: Trash2, run: () => ask({ ask: "remove", lines: selection.value }), enabled: any },
  hide: { title: "Hide or show", keys: ["h"], icon: EyeOff, run: () => ask({ ask: "hide", lines: selection.value }), enabled: any },
  group: { title: "Make a group", keys: ["Ctrl+g"], icon: Group, run: () => ask({ ask: "group", lines: selection.value }), enabled: any },
  ungroup: {
    title: "Ungroup the selection",
    keys: ["Ctrl+Shift+G"], icon: Ungroup,
    run: () => ask({ ask: "ungroup", line: selection.value.at(-1) ?? -1 }),
    enabled: () => selection.value.length === 1 && lines.value[selection.value[0] ?? -1]?.role === "use",
  },
  earlier: { title: "Move up in the list", keys: ["Alt+ArrowUp"], icon: ArrowUp, run: reorder(false), enabled: one },
  later: { title: "Move down in the list", keys: ["Alt+ArrowDown"], icon: ArrowDown, run: reorder(true), enabled: one },
  lock: { title: "Lock or unlock", keys: ["l"], icon: Lock, run: () => ask({ ask: "lock", lines: selection.value }), enabled: any },
  ground: { title: "Stand on the ground", keys: ["g"], icon: MapPin, run: () => ask({ ask: "ground", lines: selection.value }), enabled: any },
  drop: { title: "Drop onto the object below", keys: ["d"], icon: ArrowDownToLine, run: () => ask({ ask: "drop", lines: selection.value }), enabled: any },
  left: { title: "Move left", keys: ["ArrowLeft"], run: nudge(-1, 0, 0), enabled: any },
  right: { title: "Move right", keys: ["ArrowRight"], run: nudge(1, 0, 0), enabled: any },
  back: { title: "Move back", keys: ["ArrowUp"], run: nudge(0, 0, -1), enabled: any },
  front: { title: "Move forward", keys: ["ArrowDown"], run: nudge(0, 0, 1), enabled: any },
  up: { title: "Move up", keys: ["Shift+ArrowUp"], run: nudge(0, 1, 0), enabled: any },
  down: { title: "Move down", keys: ["Shift+ArrowDown"], run: nudge(0, -1, 0), enabled: any },
  none: {
    title: "Clear the selection",
    keys: ["Escape"],
    run: () => {
      chosenKeys.value = [];
      ask({ ask: "select", lines: [] });
    },
    enabled: () => any() || hasKeys(),
  },
  play: { title: "Play or stop", keys: [" "], icon: Play, run: () => (playing.value = !playing.value), enabled: () => (state.value?.frames ?? 1) > 1 },
  key: {
    title: "Set or remove keys at this frame",
    keys: ["k"], icon: KeyRound,
    run: () => wish({ do: "key", lines: selection.value }),
    enabled: any,
  },
  autoKey: {
    title: "Turn auto-key on or off",
    keys: ["Shift+K"], icon: Zap,
    run: () => wish({ do: "switch", what: "auto-key", on: !state.value?.time.autoKey }),
  },
  animate: { title: "Make an animation of 50 frames", keys: ["Shift+F"], icon: Film, run: animate, enabled: () => (state.value?.frames ?? 1) < 2 },
  copyKeys: { title: "Copy the selected keys, in the timeline", keys: ["Ctrl+c"], icon: Copy, run: copyKeys, enabled: hasKeys, ofKeys: true },
  // Ctrl+V is an event of the clipboard, whose text says if it is keys.
  pasteKeys: { title: "Paste keys at this frame", keys: [], icon: ClipboardPaste, run: pasteKeys, enabled: () => (state.value?.time.copied ?? 0) > 0 },
  path: {
    title: "Show the motion path of the selection",
    keys: ["p"], icon: Spline,
    run: () => wish({ do: "switch", what: "path", on: !state.value?.time.path }),
  },
  onion: {
    title: "Outline the selection at other frames",
    keys: ["o"], icon: Layers,
    run: () => wish({ do: "switch", what: "onion", on: !state.value?.time.onion }),
  },
  previous: { title: "Previous frame", keys: [","], icon: StepBack, run: () => goBy(-1) },
  next: { title: "Next frame", keys: ["."], icon: StepForward, run: () => goBy(1) },
  script: { title: "Look through the script's camera", keys: ["0"], icon: Video, run: () => ask({ ask: "look", at: "script" }) },
  lookFront: { title: "Look from the front", keys: ["1"], run: () => ask({ ask: "look", at: "front" }) },
  lookSide: { title: "Look from the side", keys: ["3"], run: () => ask({ ask: "look", at: "side" }) },
  lookTop: { title: "Look from above", keys: ["7"], run: () => ask({ ask: "look", at: "top" }) },
  lookBack: { title: "Look from the opposite side", keys: ["9"], run: () => ask({ ask: "look", at: "opposite" }) },
  frame: { title: "Look at the selection", keys: ["f"], icon: Focus, run: () => ask({ ask: "look", at: "selection" }) },
  keepCamera: {
    title: "Make this the script's camera",
    keys: ["c"], icon: Camera,
    run: () => ask({ ask: "keep-camera" }),
    enabled: () => state.value?.free ?? false,
  },
  draft: {
    title: "Draft: draw without indirect light, on or off",
    keys: ["Shift+D"],
    run: () => ask({ ask: "draft", on: !state.value?.draft }),
    enabled: () => (state.value?.draft ?? null) !== null,
  },
  search: { title: "Search everything", keys: ["Ctrl+k"], icon: Search, run: () => (searching.value = true) },
  help: { title: "Show the keys", keys: ["?"], icon: Keyboard, run: () => (help.value = !help.value) },
} as const satisfies Record<string, Action>;

/** Whether a field has its own use of a key. */
function takes(target: HTMLElement, control: string, key: string): boolean {
  if (control && key === "k") return false;
  if (target.closest("textarea, .code, [role=listbox], [role=separator]")) return true;
  const field = target.closest("input, select");
  if (!field) return false;
  // Undo is for the scene, except in a field for text, which has its own.
  const isText = field.matches("input:not([type]), input[type=text]");
  return isText || control === "" || !/^[zy]$/i.test(key);
}

export function listen(): void {
  addEventListener("keydown", (event) => {
    const target = event.target as HTMLElement;
    // A dialog takes all keys, and so does a page without its studio.
    if (event.altKey || !connected.value || document.querySelector("dialog[open]")) return;
    const control = event.ctrlKey || event.metaKey ? "Ctrl+" : "";
    if (takes(target, control, event.key)) return;
    if (event.key === " " && target.closest("button, a, summary")) return;
    if (event.key === "Escape" && document.querySelector("[popover]:popover-open")) return;
    const name = `${control}${event.shiftKey && event.key !== "?" ? "Shift+" : ""}${event.key}`;
    const isObject = any() && !target.closest(".timeline");
    const found = Object.values<Action>(actions).find((action) => action.keys.includes(name) && !(action.ofKeys && isObject) && (action.enabled?.() ?? true));
    // Where no step is left, the browser would undo typing in the script, as a new edit.
    const isStep = control !== "" && /^[zy]$/i.test(event.key);
    if (found || isStep) event.preventDefault();
    found?.run();
  });
}
