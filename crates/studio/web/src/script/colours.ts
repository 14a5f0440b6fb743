// Colours of words, and of the selected lines. Only lines in sight are read.

import { type Extension, StateEffect } from "@codemirror/state";
import { Decoration, type DecorationSet, type EditorView, ViewPlugin, type ViewUpdate } from "@codemirror/view";

import { selected } from "../store";
import { read } from "./language";

/** Requests that all lines are coloured again. */
export const recolour = StateEffect.define<null>();

const isRecolour = (update: ViewUpdate): boolean => update.transactions.some(({ effects }) => effects.some((effect) => effect.is(recolour)));

const chosen = Decoration.line({ class: "chosen" });

function colour(view: EditorView): DecorationSet {
  const ranges = [];
  for (const { from, to } of view.visibleRanges) {
    for (let at = from; at <= to; ) {
      const line = view.state.doc.lineAt(at);
      if (selected.peek().has(line.number - 1)) ranges.push(chosen.range(line.from));
      for (const word of read(line.text).words) {
        ranges.push(Decoration.mark({ class: `w-${word.kind}` }).range(line.from + word.from, line.from + word.to));
      }
      at = line.to + 1;
    }
  }
  return Decoration.set(ranges, true);
}

export function colours(): Extension {
  return ViewPlugin.fromClass(
    class {
      decorations: DecorationSet;

      constructor(view: EditorView) {
        this.decorations = colour(view);
      }

      update(update: ViewUpdate): void {
        if (update.docChanged || update.viewportChanged || isRecolour(update)) this.decorations = colour(update.view);
      }
    },
    { decorations: (plugin) => plugin.decorations },
  );
}
