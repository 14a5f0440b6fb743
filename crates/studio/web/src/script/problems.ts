// Errors and warnings: underlined in the text, and a mark in the margin.

import { type EditorState, type Extension, RangeSet, StateEffect, StateField } from "@codemirror/state";
import { Decoration, type DecorationSet, EditorView, gutter, GutterMarker, keymap } from "@codemirror/view";

import type { FaultState } from "../protocol";

export interface Problem {
  readonly from: number;
  readonly to: number;
  readonly fault: FaultState;
}

const show = StateEffect.define<readonly Problem[]>();

class Mark extends GutterMarker {
  constructor(
    private readonly isError: boolean,
    private readonly text: string,
  ) {
    super();
  }

  override eq(other: Mark): boolean {
    return other.isError === this.isError && other.text === this.text;
  }

  override toDOM(): HTMLElement {
    const mark = document.createElement("span");
    mark.className = this.isError ? "mark error" : "mark";
    mark.title = this.text;
    mark.textContent = this.isError ? "●" : "▲";
    return mark;
  }
}

const underlined = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(set, transaction) {
    const moved = set.map(transaction.changes);
    const found = transaction.effects.find((effect) => effect.is(show));
    if (!found) return moved;
    const problems = found.value as readonly Problem[];
    const ranges = problems.map((problem) => {
      const wave = Decoration.mark({ class: problem.fault.error ? "wave error" : "wave", problem });
      // An empty range shows nothing.
      return wave.range(problem.from, Math.max(problem.to, problem.from + 1));
    });
    const end = transaction.state.doc.length;
    return Decoration.set(ranges.filter(({ to }) => to <= end), true);
  },
  provide: (field) => EditorView.decorations.from(field),
});

/** The characters of a line before a column, which counts code points. */
function offset(text: string, column: number): number {
  let at = 0;
  for (let left = column; left > 0 && at < text.length; left -= 1) at += (text.codePointAt(at) ?? 0) > 0xffff ? 2 : 1;
  return at;
}

export function showProblems(view: EditorView, faults: readonly FaultState[]): void {
  const { doc } = view.state;
  const problems = faults.flatMap((fault) => {
    if (fault.line >= doc.lines) return [];
    const line = doc.line(fault.line + 1);
    const from = line.from + offset(line.text, fault.column);
    return [{ from, to: Math.min(line.to, from + fault.length), fault }];
  });
  if (problems.length > 0 || view.state.field(underlined).size > 0) view.dispatch({ effects: show.of(problems) });
}

/** The problems at a position. */
export function problemsAt(state: EditorState, at: number): readonly FaultState[] {
  const found: FaultState[] = [];
  state.field(underlined).between(at, at, (_from, _to, { spec }) => void found.push((spec as { problem: Problem }).problem.fault));
  return found;
}

function next(view: EditorView): boolean {
  const { head } = view.state.selection.main;
  const starts: number[] = [];
  view.state.field(underlined).between(0, view.state.doc.length, (from) => void starts.push(from));
  const to = starts.find((start) => start > head) ?? starts[0];
  if (to === undefined) return false;
  view.dispatch({ selection: { anchor: to }, scrollIntoView: true, userEvent: "select" });
  return true;
}

export function problems(): Extension {
  return [
    underlined,
    keymap.of([{ key: "F8", run: next }]),
    gutter({
      class: "marks",
      markers: (view) => {
        const marks: { from: number; mark: Mark }[] = [];
        view.state.field(underlined).between(view.viewport.from, view.viewport.to, (from, _to, { spec }) => {
          const { fault } = (spec as { problem: Problem }).problem;
          marks.push({ from: view.state.doc.lineAt(from).from, mark: new Mark(fault.error, [fault.message, fault.help].filter(Boolean).join(" ")) });
        });
        return RangeSet.of(marks.map(({ from, mark }) => mark.range(from)), true);
      },
    }),
  ];
}
