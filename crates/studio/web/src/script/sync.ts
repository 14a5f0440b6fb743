// The text of the editor and the server's lines. Each change here is sent at once. A change of the server (a drag, undo,
// another program) is rebased under those that the server has not accepted yet, which are then sent again.

import { collab, receiveUpdates, sendableUpdates } from "@codemirror/collab";
import { ChangeSet, type ChangeSpec, type Extension, Text, Transaction } from "@codemirror/state";
import { EditorView } from "@codemirror/view";

import type { LineState, ServerMessage, TextChange, TextState } from "../protocol";
import { ask, lines, playing, post, type Step } from "../store";

const PAGE = "page";
const STUDIO = "studio";

/** The milliseconds between two changes of the shown text: showing one takes as long as a picture of a drag. */
const APART = 100;

/** A change of the server, and the number of lines after it. */
interface Change {
  readonly splices: NonNullable<ServerMessage["splices"]>;
  readonly text: TextState;
  readonly count: number;
}

/** A step of undo or redo that waits, and the number of changes before it that the server has not accepted yet. */
interface Waiting {
  readonly what: Step;
  before: number;
}

export interface Sync {
  /** The extension that sends changes; made anew with each state. */
  readonly extension: () => Extension;
  /** Takes a message of the server about the text. */
  readonly hear: (view: EditorView, tell: ServerMessage, reset: (text: Text) => void) => void;
  /** Undoes or redoes a step, in the order in which it was typed: after the changes before it, before those after it. */
  readonly step: (view: EditorView, what: Step) => void;
}

export function sync(): Sync {
  let synced = Text.empty;
  let [file, version] = [0, 0];
  /** Changes that are not shown yet, and the timer that runs for a while after some were shown. */
  let waiting: Change[] = [];
  let timer = 0;
  /** The steps that are not sent yet, and the number of the message with the one that has no answer yet, else 0. */
  let steps: Waiting[] = [];
  let awaited = 0;
  /** The number of changes that are sent and have no answer yet. */
  let flying = 0;

  const send = (before: Text, changes: ChangeSet, after: Text): void => {
    ask({ ask: "edit", file, version, changes: lineChanges(before, changes, after) });
    flying += 1;
  };

  /** Sends the changes that have not been sent, up to the next step, and the step as soon as none is before it. */
  const proceed = (view: EditorView): void => {
    if (awaited) return;
    const pending = sendableUpdates(view.state);
    const most = steps[0]?.before ?? pending.length;
    let before = synced;
    for (const [at, { changes }] of pending.slice(0, most).entries()) {
      const after = changes.apply(before);
      if (at >= flying) send(before, changes, after);
      before = after;
    }
    if (most > 0) return;
    const next = steps.shift();
    if (next) awaited = post({ ask: next.what });
  };

  const extension = (): Extension => [
    collab({ clientID: PAGE }),
    EditorView.updateListener.of((update) => {
      for (const transaction of update.transactions) {
        if (!transaction.docChanged || transaction.annotation(Transaction.remote)) continue;
        playing.value = false;
        if (!awaited && steps.length === 0) send(transaction.startState.doc, transaction.changes, transaction.newDoc);
      }
    }),
  ];

  const take = (view: EditorView, changes: ChangeSet, clientID: string): void => {
    const transaction = receiveUpdates(view.state, [{ changes, clientID }]);
    const after = view.state.selection.map(transaction.changes, 1);
    view.dispatch(transaction);
    // The caret is behind the text that a step brings back, as if it were typed again.
    if (awaited && clientID === STUDIO && !after.eq(view.state.selection)) view.dispatch({ selection: after });
  };

  const show = (view: EditorView): void => {
    clearTimeout(timer);
    timer = 0;
    if (waiting.length === 0) return;
    let all = ChangeSet.empty(synced.length);
    const caret = sendableUpdates(view.state).length === 0 ? view.state.selection.main.head : undefined;
    for (const { splices, text, count } of waiting.splice(0)) {
      version = text.version;
      const changes = serverChanges(synced, splices, text.ends, count, caret);
      synced = changes.apply(synced);
      all = all.compose(changes);
    }
    take(view, all, STUDIO);
    // Changes of an older version were refused.
    flying = 0;
    proceed(view);
    timer = window.setTimeout(() => show(view), APART);
  };

  const hearText = (view: EditorView, tell: ServerMessage, reset: (text: Text) => void): void => {
    if (tell.lines && tell.text) {
      waiting = [];
      steps = [];
      flying = 0;
      ({ file, version } = tell.text);
      synced = Text.of(textLines(tell.lines, tell.text.ends));
      reset(synced);
      return;
    }
    if (tell.accepted === true) {
      show(view);
      const [first] = sendableUpdates(view.state);
      if (!first) return;
      synced = first.changes.apply(synced);
      flying -= 1;
      for (const step of steps) step.before -= 1;
      take(view, first.changes, PAGE);
      proceed(view);
      return;
    }
    if (!tell.splices || !tell.text) return;
    waiting.push({ splices: tell.splices, text: tell.text, count: lines.value.length });
    // A drag changes numbers within lines.
    const isDrag = tell.splices.every((splice) => splice.removed === splice.lines.length);
    if (!isDrag || awaited || timer === 0) show(view);
  };

  const hear: Sync["hear"] = (view, tell, reset) => {
    hearText(view, tell, reset);
    if (!awaited || (tell.state?.asked ?? 0) < awaited) return;
    show(view);
    awaited = 0;
    proceed(view);
  };

  const step: Sync["step"] = (view, what) => {
    steps.push({ what, before: sendableUpdates(view.state).length });
    proceed(view);
  };
  return { extension, hear, step };
}

/** The lines that an editor shows of a script: after a line end at its end there is an empty one. */
export function textLines(of: readonly LineState[], ends: boolean): readonly string[] {
  const texts = of.map(({ text }) => text);
  return ends || texts.length === 0 ? [...texts, ""] : texts;
}

/** Changes as replaced lines, each with the line number that the ones before it leave. */
export function lineChanges(before: Text, changes: ChangeSet, after: Text): readonly TextChange[] {
  const spans: { fromA: number; toA: number; fromB: number; toB: number }[] = [];
  changes.iterChangedRanges((fromA, toA, fromB, toB) => {
    const span = {
      fromA: before.lineAt(fromA).number,
      toA: before.lineAt(toA).number,
      fromB: after.lineAt(fromB).number,
      toB: after.lineAt(toB).number,
    };
    const last = spans.at(-1);
    if (last && span.fromA <= last.toA) [last.toA, last.toB] = [span.toA, span.toB];
    else spans.push(span);
  });
  return spans.map(({ fromA, toA, fromB, toB }) => ({
    at: fromB - 1,
    removed: toA - fromA + 1,
    lines: Array.from({ length: toB - fromB + 1 }, (_, row) => after.line(fromB + row).text),
  }));
}

/** The changes of a text by the server's splices, as small as they can be, at the caret where they can be, so that it stays. */
export function serverChanges(text: Text, splices: NonNullable<ServerMessage["splices"]>, ends: boolean, count: number, caret?: number): ChangeSet {
  let doc = text;
  let all = ChangeSet.empty(doc.length);
  const change = (spec: ChangeSpec): void => {
    const changes = ChangeSet.of(spec, doc.length);
    doc = changes.apply(doc);
    all = all.compose(changes);
  };
  for (const { at, removed, lines: inserted } of splices) {
    const here = caret === undefined ? undefined : all.mapPos(caret);
    change(spliceChange(doc, at, removed, inserted.map((line) => line.text), here));
  }
  const wanted = ends || count === 0 ? count + 1 : count;
  if (doc.lines > wanted) change({ from: doc.line(wanted).to, to: doc.length });
  if (doc.lines < wanted) change({ from: doc.length, insert: Text.of(["", ""]) });
  return all;
}

function spliceChange(doc: Text, at: number, removed: number, inserted: readonly string[], caret: number | undefined): ChangeSpec {
  if (removed === inserted.length) {
    return inserted.flatMap((text, row) => {
      const line = doc.line(at + row + 1);
      return smallest(doc, line.from, line.to, text, caret);
    });
  }
  if (removed === 0) {
    if (at < doc.lines) return { from: doc.line(at + 1).from, insert: Text.of([...inserted, ""]) };
    return { from: doc.length, insert: Text.of(["", ...inserted]) };
  }
  const from = doc.line(at + 1).from;
  if (inserted.length > 0) return smallest(doc, from, doc.line(at + removed).to, inserted.join("\n"), caret);
  if (at + removed < doc.lines) return { from, to: doc.line(at + removed + 1).from };
  return { from: Math.max(0, from - 1), to: doc.length };
}

/** A change of some lines without the characters that stay. Of equal ones, those at the caret have changed. */
function smallest(doc: Text, from: number, to: number, insert: string, caret: number | undefined): readonly ChangeSpec[] {
  const old = doc.sliceString(from, to);
  if (old === insert) return [];
  const most = Math.min(old.length, insert.length);
  let [same, rest] = [0, 0];
  while (same < most && old[same] === insert[same]) same += 1;
  while (rest < most && old[old.length - 1 - rest] === insert[insert.length - 1 - rest]) rest += 1;
  const end = caret === undefined ? same : caret - from - Math.max(0, old.length - insert.length);
  same = Math.min(same, Math.max(most - rest, end));
  rest = Math.min(rest, most - same);
  return [{ from: from + same, to: to - rest, insert: Text.of(insert.slice(same, insert.length - rest).split("\n")) }];
}
