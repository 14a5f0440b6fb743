// The script: the editor, and its problems as a list.

import "./script.css";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { Panel } from "../parts/panel";
import { ask, files, state } from "../store";
import { open, openAt } from "./editor";

/** The largest number of listed problems. */
const LISTED = 20;

/** Shows the first frame of a file, from 0. */
export function showFile(file: number): void {
  const frame = files.value.slice(0, file).reduce((frames, { frames: own }) => frames + own, 0);
  ask({ ask: "frame", frame, moving: false });
}

/** Opens a line of a file and puts the caret to a column, all from 0. */
export function openPlace(file: number, line: number, column: number): void {
  openAt(file, line, column);
  if (state.value?.file !== file) showFile(file);
  ask({ ask: "select", lines: [line] });
}

export function Script(): JSX.Element {
  const host = useRef<HTMLDivElement>(null);
  useEffect(() => (host.current ? open(host.current) : undefined), []);
  const now = state.value;
  const faults = now?.faults ?? [];
  return (
    <Panel name="script" title="Script">
      <div ref={host} class="code" />
      <div class="faults" role="status">
        {faults.slice(0, LISTED).map((fault) => (
          <button
            type="button"
            key={`${fault.line}:${fault.column}:${fault.message}`}
            class={fault.error ? "fault error" : "fault"}
            onClick={() => openPlace(now?.file ?? 0, fault.line, fault.column)}
          >
            <b>
              {fault.error ? "Error" : "Warning"} in line {fault.line + 1}:
            </b>{" "}
            {fault.message}
            {fault.help && <i> {fault.help}</i>}
          </button>
        ))}
      </div>
    </Panel>
  );
}
