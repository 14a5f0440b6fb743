// Folding of groups and of comments of several lines.

import { type EditorState, type Extension, RangeSet, StateEffect, StateField } from "@codemirror/state";
import { Decoration, type DecorationSet, EditorView, gutter, GutterMarker, keymap, WidgetType } from "@codemirror/view";

const toggle = StateEffect.define<{ readonly from: number; readonly to: number }>({
  map: ({ from, to }, changes) => ({ from: changes.mapPos(from), to: changes.mapPos(to) }),
});

class Dots extends WidgetType {
  override toDOM(view: EditorView): HTMLElement {
    const dots = document.createElement("button");
    dots.type = "button";
    dots.className = "dots";
    dots.textContent = "…";
    dots.title = "Unfold";
    dots.onclick = () => void unfold(view, view.posAtDOM(dots));
    return dots;
  }
}

const hidden = Decoration.replace({ widget: new Dots() });

const folded = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(set, transaction) {
    let now = set.map(transaction.changes);
    // A change within folded lines unfolds them.
    transaction.changes.iterChangedRanges((_fromA, _toA, fromB, toB) => {
      now = now.update({ filterFrom: fromB, filterTo: toB, filter: (from, to) => to < fromB || from > toB || from === toB });
    });
    const { head } = transaction.state.selection.main;
    if (transaction.selection) now = now.update({ filter: (from, to) => head <= from || head > to });
    for (const effect of transaction.effects) {
      if (!effect.is(toggle)) continue;
      const { from, to } = effect.value;
      let was = false;
      now.between(from, from, (start) => void (was ||= start === from));
      now = was ? now.update({ filter: (start) => start !== from }) : now.update({ add: [hidden.range(from, to)] });
    }
    return now;
  },
  provide: (field) => [EditorView.decorations.from(field), EditorView.atomicRanges.of((view) => view.state.field(field))],
});

const isGroup = (text: string): boolean => /^\s*group\b/i.test(text);
const isComment = (text: string): boolean => /^\s*#/.test(text);

/** Whether a line begins a part that can be folded. */
function begins(state: EditorState, number: number): boolean {
  const text = (at: number): string => (at >= 1 && at <= state.doc.lines ? state.doc.line(at).text : "");
  if (isGroup(text(number))) return true;
  return isComment(text(number)) && !isComment(text(number - 1)) && isComment(text(number + 1));
}

/** The part that a line begins. */
function part(state: EditorState, number: number): { from: number; to: number } | null {
  if (!begins(state, number)) return null;
  const first = state.doc.line(number);
  const ends = isGroup(first.text) ? (text: string) => /^\s*end\b/i.test(text) : (text: string) => !isComment(text);
  let last = number;
  while (last < state.doc.lines && !ends(state.doc.line(last + 1).text)) last += 1;
  return last > number ? { from: first.to, to: state.doc.line(last).to } : null;
}

function fold(view: EditorView, number: number): boolean {
  const of = part(view.state, number);
  if (of) view.dispatch({ effects: toggle.of(of) });
  return of !== null;
}

/** Unfolds what hides a position. */
export function unfold(view: EditorView, at: number): boolean {
  const found: { from: number; to: number }[] = [];
  view.state.field(folded).between(at, at, (from, to) => void found.push({ from, to }));
  if (found.length > 0) view.dispatch({ effects: found.map((range) => toggle.of(range)) });
  return found.length > 0;
}

/** The line of the innermost part around the caret. */
function around(state: EditorState): number {
  const here = state.doc.lineAt(state.selection.main.head).number;
  for (let number = here; number >= 1; number -= 1) {
    const of = part(state, number);
    if (of && of.to >= state.doc.line(here).from) return number;
  }
  return here;
}

class Arrow extends GutterMarker {
  constructor(private readonly isFolded: boolean) {
    super();
  }

  override eq(other: Arrow): boolean {
    return other.isFolded === this.isFolded;
  }

  override toDOM(): HTMLElement {
    const arrow = document.createElement("span");
    arrow.textContent = this.isFolded ? "›" : "⌄";
    arrow.title = this.isFolded ? "Unfold" : "Fold";
    return arrow;
  }
}

const ARROWS = [new Arrow(false), new Arrow(true)] as const;

export function folding(): Extension {
  return [
    folded,
    keymap.of([
      { key: "Ctrl-Shift-[", mac: "Cmd-Alt-[", run: (view) => fold(view, around(view.state)) },
      { key: "Ctrl-Shift-]", mac: "Cmd-Alt-]", run: (view) => unfold(view, view.state.doc.lineAt(view.state.selection.main.head).to) },
    ]),
    gutter({
      class: "arrows",
      markers: (view) => {
        const set = view.state.field(folded);
        const marks = view.viewportLineBlocks.flatMap((block) => {
          const line = view.state.doc.lineAt(block.from);
          if (!begins(view.state, line.number)) return [];
          let is = false;
          set.between(line.to, line.to, () => void (is = true));
          return [ARROWS[is ? 1 : 0].range(line.from)];
        });
        return RangeSet.of(marks);
      },
      domEventHandlers: {
        click: (view, block) => fold(view, view.state.doc.lineAt(block.from).number),
      },
    }),
  ];
}
