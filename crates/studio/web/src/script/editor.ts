// The editor of the script: CodeMirror with the parts of this folder. It lives in a shadow tree, where its styles are
// allowed under the page's policy.

import * as cm from "@codemirror/commands";
import { gotoLine, search, searchKeymap } from "@codemirror/search";
import { Compartment, EditorSelection, EditorState, type Extension, Text, Transaction } from "@codemirror/state";
import { drawSelection, dropCursor, EditorView, highlightSpecialChars, keymap, lineNumbers, rectangularSelection } from "@codemirror/view";
import { effect } from "@preact/signals";

import { actions } from "../actions";
import { connected, language, lines, notice, onText, select, selected, selection, state } from "../store";
import { colours, recolour } from "./colours";
import { completion } from "./completion";
import { folding, unfold } from "./folding";
import { hover } from "./hover";
import { problems, showProblems } from "./problems";
import { type Sync, sync } from "./sync";
import { theme } from "./theme";

/** The longest text that one change may insert; more does not fit into a message. */
const LONGEST = 1 << 20;

const both = (key: string, run: (view: EditorView) => boolean, shift: (view: EditorView) => boolean) => ({ key, run, shift });

/** Asks for a line. The package returns the focus to editors outside of a shadow tree alone. */
function askLine(view: EditorView): boolean {
  gotoLine(view);
  view.dom.querySelector(".cm-goto-line")?.addEventListener("keydown", (event) => {
    if (["Enter", "Escape"].includes((event as KeyboardEvent).key)) setTimeout(() => view.focus());
  });
  return true;
}

const keys = [
  both("ArrowLeft", cm.cursorCharLeft, cm.selectCharLeft),
  both("ArrowRight", cm.cursorCharRight, cm.selectCharRight),
  both("ArrowUp", cm.cursorLineUp, cm.selectLineUp),
  both("ArrowDown", cm.cursorLineDown, cm.selectLineDown),
  both("Mod-ArrowLeft", cm.cursorGroupLeft, cm.selectGroupLeft),
  both("Mod-ArrowRight", cm.cursorGroupRight, cm.selectGroupRight),
  both("PageUp", cm.cursorPageUp, cm.selectPageUp),
  both("PageDown", cm.cursorPageDown, cm.selectPageDown),
  both("Home", cm.cursorLineBoundaryBackward, cm.selectLineBoundaryBackward),
  both("End", cm.cursorLineBoundaryForward, cm.selectLineBoundaryForward),
  both("Mod-Home", cm.cursorDocStart, cm.selectDocStart),
  both("Mod-End", cm.cursorDocEnd, cm.selectDocEnd),
  { key: "Enter", run: cm.insertNewline },
  { key: "Mod-a", run: cm.selectAll },
  { key: "Mod-Backspace", run: cm.deleteGroupBackward },
  { key: "Mod-Delete", run: cm.deleteGroupForward },
  { key: "Alt-ArrowUp", run: cm.moveLineUp },
  { key: "Alt-ArrowDown", run: cm.moveLineDown },
  { key: "Shift-Alt-ArrowUp", run: cm.copyLineUp },
  { key: "Shift-Alt-ArrowDown", run: cm.copyLineDown },
  { key: "Mod-Shift-k", run: cm.deleteLine },
  { key: "Mod-Alt-ArrowUp", run: cm.addCursorAbove },
  { key: "Mod-Alt-ArrowDown", run: cm.addCursorBelow },
  { key: "Mod-/", run: cm.toggleLineComment },
  { key: "Escape", run: cm.simplifySelection },
  { key: "Mod-g", run: askLine },
  { key: "Mod-z", run: () => (actions.undo.run(), true), shift: () => (actions.redo.run(), true) },
  { key: "Mod-y", run: () => (actions.redo.run(), true) },
];

/** Selects the line of the caret in the other panels. */
const follow = EditorView.updateListener.of((update) => {
  const isOwn = update.transactions.some((transaction) => transaction.annotation(Transaction.userEvent) !== undefined);
  if (!isOwn || !(update.selectionSet || update.docChanged)) return;
  const line = update.state.doc.lineAt(update.state.selection.main.head).number - 1;
  if (selection.peek().length !== 1 || selection.peek()[0] !== line) select([line]);
});

const short = EditorState.changeFilter.of((transaction) => {
  const isShort = transaction.annotation(Transaction.remote) === true || transaction.newDoc.length - transaction.startState.doc.length <= LONGEST;
  if (!isShort) notice.value = "More than 1 MiB cannot be inserted at once.";
  return isShort;
});

/** Typing over a selection, deletions, and *Undo* of the browser's menu. A browser would keep the style of removed text as a
 * style attribute, and undo typing as a new edit. */
const typeOver = EditorView.domEventHandlers({
  beforeinput: (event, view) => {
    const { data, inputType } = event as InputEvent;
    const step = { historyUndo: actions.undo, historyRedo: actions.redo }[inputType];
    if (step) {
      event.preventDefault();
      step.run();
      return true;
    }
    const { selection: now, readOnly } = view.state;
    const forward = inputType === "deleteContentForward";
    const isTyped = inputType === "insertText" && data && !now.main.empty;
    if (view.composing || readOnly || !(isTyped || forward || inputType === "deleteContentBackward")) return false;
    event.preventDefault();
    const change = isTyped
      ? view.state.replaceSelection(data)
      : view.state.changeByRange((range) => {
          const gone = EditorSelection.range(range.anchor, (range.empty ? view.moveByChar(range, forward) : range).head);
          return { changes: gone, range: EditorSelection.cursor(gone.from) };
        });
    view.dispatch(change, { userEvent: isTyped ? "input.type" : "delete", scrollIntoView: true });
    return true;
  },
});

const writable = new Compartment();
const readOnly = (): Extension => [EditorState.readOnly.of(!connected.peek()), EditorView.editable.of(connected.peek())];

function extensions(text: Sync): Extension {
  return [
    text.extension(),
    writable.of(readOnly()),
    // A bare carriage return is a character of its line.
    EditorState.lineSeparator.of("\n"),
    EditorView.clipboardInputFilter.of((pasted) => pasted.replace(/\r\n?/g, "\n")),
    EditorState.allowMultipleSelections.of(true),
    EditorState.languageData.of(() => [{ commentTokens: { line: "#" } }]),
    EditorView.contentAttributes.of({ "aria-label": "Script", tabindex: "0" }),
    short,
    typeOver,
    completion(),
    problems(),
    lineNumbers(),
    folding(),
    colours(),
    hover(),
    drawSelection(),
    EditorView.lineWrapping,
    highlightSpecialChars(),
    dropCursor(),
    rectangularSelection(),
    search({ top: true }),
    keymap.of([...keys, ...searchKeymap]),
    follow,
    theme,
  ];
}

let view: EditorView | null = null;
/** The place that the caret goes to as soon as its file is shown. */
let place: { readonly file: number; readonly line: number; readonly column: number } | null = null;

/** Opens the editor in an element. Returns how it is closed. */
export function open(host: HTMLElement): () => void {
  const root = host.shadowRoot ?? host.attachShadow({ mode: "open" });
  const text = sync();
  const create = (doc: Text): EditorState => EditorState.create({ doc, extensions: extensions(text) });
  const editor = new EditorView({ state: create(Text.empty), parent: root, root });
  view = editor;
  onText(
    (tell) => text.hear(editor, tell, (doc) => editor.setState(create(doc))),
    (what) => text.step(editor, what),
  );
  const ends = [
    effect(() => {
      void connected.value;
      editor.dispatch({ effects: writable.reconfigure(readOnly()) });
    }),
    effect(() => {
      void [language.value, selected.value];
      editor.dispatch({ effects: recolour.of(null) });
    }),
    effect(() => {
      const faults = state.value?.faults ?? [];
      void lines.value;
      showProblems(editor, faults);
    }),
    effect(() => {
      void lines.value;
      const line = selection.value.at(-1);
      // Who types is not led elsewhere: the selection follows the caret.
      if (line !== undefined && !place && root.activeElement !== editor.contentDOM) reveal(line);
      if (place && place.file === state.value?.file) {
        const { line, column } = place;
        place = null;
        reveal(line, column);
      }
    }),
  ];
  return () => {
    ends.forEach((end) => end());
    onText(() => {});
    editor.destroy();
    view = null;
  };
}

/** Brings a line in sight, and the caret to it if that is elsewhere; with a column, the focus too. */
function reveal(line: number, column?: number): void {
  if (!view || line >= view.state.doc.lines) return;
  const of = view.state.doc.line(line + 1);
  const isHere = view.state.doc.lineAt(view.state.selection.main.head).number === line + 1;
  if (isHere && column === undefined) return;
  const anchor = Math.min(of.to, of.from + (column ?? 0));
  unfold(view, anchor);
  view.dispatch({ selection: { anchor }, effects: EditorView.scrollIntoView(anchor, { y: "nearest", yMargin: 24 }) });
  if (column !== undefined) view.focus();
}

/** Puts the caret to a place of a file as soon as it is shown, all from 0. */
export function openAt(file: number, line: number, column: number): void {
  if (state.peek()?.file === file) reveal(line, column);
  else place = { file, line, column };
}
