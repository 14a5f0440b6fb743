// The script, line by line. Typed changes are rendered at once, and drags change the text here.

import { computed } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { List } from "./list";
import type { Fault, Line } from "./protocol";
import { ask, files, lines, selected, selection, state } from "./store";

const ROW = 24;

const faultsByLine = computed(() => {
  const byLine = new Map<number, Fault[]>();
  for (const fault of state.value?.faults ?? []) byLine.set(fault.line, [...(byLine.get(fault.line) ?? []), fault]);
  return byLine;
});

/** The line that the caret goes to when it is there, and its column. */
let caret: { readonly line: number; readonly column: number } | null = null;

/** Opens a line of a file and puts the caret to a column, all from 0. */
export function openPlace(file: number, line: number, column: number): void {
  const before = files.value.slice(0, file).reduce((frames, { frames: own }) => frames + own, 0);
  if (state.value?.file !== file) ask({ ask: "frame", frame: before, moving: false });
  caret = { line, column };
  ask({ ask: "select", lines: [line] });
}

export function Script(): JSX.Element {
  const faults = state.value?.faults ?? [];
  const file = state.value?.title ?? "";
  return (
    <section class="panel script" aria-labelledby="script-title">
      <h2 id="script-title">Script</h2>
      <List
        class="list code"
        count={Math.max(1, lines.value.length)}
        height={ROW}
        reveal={selection.value.at(-1) ?? null}
        role="group"
        aria-label={`Lines of ${file}`}
        tabIndex={0}
      >
        {(row) => <Row at={row} line={lines.value[row]} />}
      </List>
      <div class="faults" role="status">
        {faults.slice(0, 20).map((fault) => (
          <button
            type="button"
            key={`${fault.line}:${fault.column}:${fault.message}`}
            class={fault.error ? "fault error" : "fault"}
            onClick={() => ask({ ask: "select", lines: [fault.line] })}
          >
            <b>
              {fault.error ? "Error" : "Warning"} in line {fault.line + 1}:
            </b>{" "}
            {fault.message}
            {fault.help && <i> {fault.help}</i>}
          </button>
        ))}
      </div>
    </section>
  );
}

function Row({ at, line }: { readonly at: number; readonly line: Line | undefined }): JSX.Element {
  const input = useRef<HTMLInputElement>(null);
  const sent = useRef<string[]>([]);
  const text = line?.text ?? "";
  useEffect(() => {
    const element = input.current;
    if (!element) return;
    // Newer typed text is overwritten neither by its own echo nor by the previous text.
    const echo = sent.current.indexOf(text);
    if (echo >= 0) sent.current.splice(0, echo + 1);
    else if (sent.current.length === 0 && element.value !== text) element.value = text;
    if (caret?.line === at) {
      element.focus();
      element.setSelectionRange(caret.column, caret.column);
      caret = null;
    }
  });
  const faults = faultsByLine.value.get(at) ?? [];
  const go = (to: number, column: number): void => {
    caret = { line: to, column };
    ask({ ask: "select", lines: [to] });
  };
  const keyed = (event: KeyboardEvent & { readonly currentTarget: HTMLInputElement }): void => {
    const element = event.currentTarget;
    const column = element.selectionStart ?? 0;
    const alone = element.selectionEnd === column;
    if (event.key === "Enter") {
      sent.current = [];
      go(at + 1, 0);
      ask({ ask: "text", line: at, text: `${element.value.slice(0, column)}\n${element.value.slice(column)}` });
      caret = { line: at + 1, column: 0 };
    } else if (event.key === "ArrowUp" && at > 0) go(at - 1, column);
    else if (event.key === "ArrowDown" && at + 1 < lines.value.length) go(at + 1, column);
    else if (event.key === "Backspace" && alone && column === 0 && at > 0) {
      const before = lines.value[at - 1]?.text ?? "";
      ask({ ask: "text", line: at - 1, text: before + element.value });
      ask({ ask: "remove", lines: [at] });
      go(at - 1, before.length);
    } else if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") {
      sent.current = [];
      ask({ ask: event.shiftKey ? "redo" : "undo" });
    } else {
      if (event.key === "Home") element.closest(".list")?.scrollTo({ left: 0 });
      return;
    }
    event.preventDefault();
  };
  const isSelected = selected.value.has(at);
  return (
    <div class={isSelected ? "line selected" : "line"}>
      <span class="number" aria-hidden="true">
        {at + 1}
      </span>
      <span class="text">
        <input
          ref={input}
          class={line?.text.trimStart().startsWith("#") ? "comment" : ""}
          aria-label={`Line ${at + 1}`}
          aria-invalid={faults.some((fault) => fault.error)}
          spellcheck={false}
          autocomplete="off"
          onKeyDown={keyed}
          onFocus={() => {
            if (!isSelected) ask({ ask: "select", lines: [at] });
          }}
          onInput={(event) => {
            sent.current.push(event.currentTarget.value);
            ask({ ask: "text", line: at, text: event.currentTarget.value });
          }}
          onBlur={(event) => {
            sent.current = [];
            event.currentTarget.value = lines.value[at]?.text ?? "";
          }}
        />
        {faults.map((fault) => (
          <span
            key={fault.column}
            class={fault.error ? "wave error" : "wave"}
            style={{ left: `${fault.column}ch`, width: `${Math.max(1, fault.length)}ch` }}
          />
        ))}
      </span>
    </div>
  );
}
