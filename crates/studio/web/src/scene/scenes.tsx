// The scripts of a folder, each with a small picture of its first frame.

import { effect, signal } from "@preact/signals";
import type { JSX } from "preact";

import { Drawn } from "#drawn";
import { List } from "../parts/list";
import { Panel } from "../parts/panel";
import { visible } from "../parts/visible";
import { ask, files, state } from "../store";

const ROW = 44;

/** How often each script has been written, by which its picture is fetched again. */
const written = signal<ReadonlyMap<string, number>>(new Map());

let saved = "yes";
effect(() => {
  const now = state.value;
  const name = now && files.value[now.file]?.name;
  if (now && name && now.saved === "yes" && saved !== "yes") {
    written.value = new Map(written.peek()).set(name, (written.peek().get(name) ?? 0) + 1);
  }
  saved = now?.saved ?? "yes";
});

export function Scenes(): JSX.Element | null {
  const all = files.value;
  const shown = state.value?.file ?? 0;
  if (all.length < 2) return null;
  const starts: number[] = [];
  all.reduce((start, { frames }) => (starts.push(start), start + frames), 0);
  return (
    <Panel name="scenes" title="Scripts">
      <List class="list" count={all.length} height={ROW} reveal={shown} role="group" aria-label="Scripts of the folder">
        {(row) => {
          const file = all[row];
          if (!file) return null;
          const name = visible(file.name);
          return (
            <button
              type="button"
              class={row === shown ? "scene shown" : "scene"}
              aria-current={row === shown}
              onClick={() => ask({ ask: "frame", frame: starts[row] ?? 0, moving: false })}
            >
              <Drawn src={`thumbnail.png?${row},${written.value.get(file.name) ?? 0}`} loading="lazy" />
              <span class="name">{name}</span>
              {file.faulty && <span class="failed">error</span>}
            </button>
          );
        }}
      </List>
    </Panel>
  );
}
