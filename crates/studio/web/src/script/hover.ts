// Help for the word under the pointer: the command with its syntax, or the parameter with its unit and range.

import type { Extension } from "@codemirror/state";
import { hoverTooltip } from "@codemirror/view";

import { range, read } from "./language";
import { problemsAt } from "./problems";

function paragraph(text: string, kind = ""): HTMLElement {
  const element = document.createElement("p");
  element.className = kind;
  element.textContent = text;
  return element;
}

export function hover(): Extension {
  return hoverTooltip((view, at) => {
    const line = view.state.doc.lineAt(at);
    const word = read(line.text).words.find(({ from, to }) => line.from + from <= at && at <= line.from + to);
    const faults = problemsAt(view.state, at);
    const help: HTMLElement[] = faults.map((fault) => paragraph([fault.message, fault.help].filter(Boolean).join(" "), fault.error ? "error" : "doubt"));
    if (word?.parameter) {
      help.push(paragraph(`${word.number}: ${word.parameter.meaning}`, "title"), paragraph(range(word.parameter)));
    } else if (word?.entry && (word.kind === "command" || word.kind === "word")) {
      help.push(paragraph(word.entry.usage, "usage"), paragraph(word.entry.about));
    }
    if (help.length === 0) return null;
    const from = line.from + (word?.from ?? at - line.from);
    return {
      pos: from,
      end: line.from + (word?.to ?? at - line.from),
      above: true,
      create: () => {
        const dom = document.createElement("div");
        dom.className = "help";
        dom.append(...help);
        return { dom };
      },
    };
  });
}
