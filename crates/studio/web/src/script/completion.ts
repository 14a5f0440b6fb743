// Completion of commands, clauses and names. Enter accepts only after the list was entered by an arrow key, so that a
// line that is typed quickly is never changed.

import { EditorState, type Extension, Prec, StateEffect, StateField } from "@codemirror/state";
import { EditorView, keymap, showTooltip, type Tooltip } from "@codemirror/view";

import { choices } from "./language";

interface Offer {
  readonly from: number;
  readonly options: readonly { readonly label: string; readonly about: string }[];
  readonly chosen: number;
  /** Whether the list was opened or entered by a key, so that Enter accepts. */
  readonly entered: boolean;
}

/** The largest number of listed options. */
const SEEN = 12;

const open = StateEffect.define<{ readonly entered: boolean }>();
const move = StateEffect.define<number>();
const close = StateEffect.define<null>();

function offer(state: EditorState, entered: boolean): Offer | null {
  const { main } = state.selection;
  if (!main.empty || state.selection.ranges.length > 1 || state.readOnly) return null;
  const line = state.doc.lineAt(main.head);
  const column = main.head - line.from;
  const word = /[^\s,(]*$/.exec(line.text.slice(0, column))?.[0] ?? "";
  // In the middle of a word, or before one is begun, nothing opens by itself.
  if (/^[^\s,()#]/.test(line.text.slice(column)) || (!entered && !/^[a-z]/i.test(word))) return null;
  const typed = word.toLowerCase();
  const found = choices(line.text, column).filter(({ label }) => label.toLowerCase().startsWith(typed));
  if (found.length === 0 || (found.length === 1 && found[0]?.label.toLowerCase() === typed)) return null;
  return { from: main.head - word.length, options: found.slice(0, SEEN), chosen: 0, entered };
}

const offered = StateField.define<Offer | null>({
  create: () => null,
  update(now, transaction) {
    for (const effect of transaction.effects) {
      if (effect.is(close)) return null;
      if (effect.is(open)) return offer(transaction.state, effect.value.entered);
      if (effect.is(move) && now) {
        const count = now.options.length;
        return { ...now, chosen: (now.chosen + effect.value + count) % count, entered: true };
      }
    }
    if (transaction.docChanged && transaction.isUserEvent("input.type")) return offer(transaction.state, false);
    if (transaction.docChanged && now && transaction.isUserEvent("delete")) return offer(transaction.state, now.entered);
    return transaction.docChanged || transaction.selection ? null : now;
  },
  provide: (field) => [
    showTooltip.from(field, (now) => now && tooltip(now)),
    EditorView.contentAttributes.from(field, (now) =>
      now ? { "aria-controls": "completions", "aria-activedescendant": `completion-${now.chosen}` } : {},
    ),
  ],
});

function tooltip({ from, options, chosen }: Offer): Tooltip {
  return {
    pos: from,
    create: (view) => {
      const list = document.createElement("ul");
      list.className = "completions";
      list.id = "completions";
      list.role = "listbox";
      list.ariaLabel = "Completions";
      options.forEach(({ label, about }, at) => {
        const item = document.createElement("li");
        item.id = `completion-${at}`;
        item.role = "option";
        item.ariaSelected = String(at === chosen);
        const name = document.createElement("b");
        name.textContent = label;
        item.append(name, ` ${about}`);
        item.onmousedown = (event) => {
          event.preventDefault();
          accept(view, at);
        };
        list.append(item);
      });
      return { dom: list };
    },
  };
}

function accept(view: EditorView, at?: number): boolean {
  const now = view.state.field(offered);
  const option = now?.options[at ?? now.chosen];
  if (!now || !option) return false;
  const to = view.state.selection.main.head;
  view.dispatch({
    changes: { from: now.from, to, insert: option.label },
    selection: { anchor: now.from + option.label.length },
    effects: close.of(null),
    userEvent: "input.complete",
  });
  return true;
}

const step = (by: number) => (view: EditorView): boolean => {
  if (!view.state.field(offered)) return false;
  view.dispatch({ effects: move.of(by) });
  return true;
};

export function completion(): Extension {
  return [
    offered,
    EditorView.focusChangeEffect.of((_, focused) => (focused ? null : close.of(null))),
    Prec.highest(
      keymap.of([
        { key: "Ctrl-Space", run: (view) => (view.dispatch({ effects: open.of({ entered: true }) }), true) },
        { key: "ArrowDown", run: step(1) },
        { key: "ArrowUp", run: step(-1) },
        { key: "Tab", run: (view) => accept(view) },
        { key: "Enter", run: (view) => (view.state.field(offered)?.entered ? accept(view) : false) },
        {
          key: "Escape",
          run: (view) => {
            if (!view.state.field(offered)) return false;
            view.dispatch({ effects: close.of(null) });
            return true;
          },
        },
      ]),
    ),
  ];
}
