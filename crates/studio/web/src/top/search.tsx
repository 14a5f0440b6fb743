// Search over everything: actions with their keys, what can be added, and the lines of the script.

import { computed, signal } from "@preact/signals";
import type { JSX } from "preact";

import { type Action, actions } from "../actions";
import { nameOf } from "../inspector/words";
import { keyName } from "../parts/button";
import { visible } from "../parts/visible";
import { ask, examples, lines, searching, select, tables } from "../store";

/** The number of results. */
const SHOWN = 12;

interface Found {
  readonly text: string;
  readonly note: string;
  readonly run: () => void;
}

const typed = signal("");
const chosen = signal(0);

const all = computed((): readonly Found[] => [
  ...Object.values<Action>(actions)
    .filter((action) => action.enabled?.() ?? true)
    .map(({ title, keys, run }) => ({ text: title, note: keyName(keys[0] ?? ""), run })),
  ...tables.value
    .filter(({ role, fields, name }) => ["object", "light"].includes(role) || name === "Material" || (role === "setting" && fields.length > 0))
    .map(({ name }) => ({ text: `Add ${nameOf(name)}`, note: name, run: () => ask({ ask: "add", command: name, at: null }) })),
  ...lines.value.flatMap(({ name, subject, command, role }, at) =>
    role && (name || subject) ? [{ text: visible(name ?? subject ?? ""), note: command ?? "", run: () => select([at]) }] : [],
  ),
  ...examples.value.map((name) => ({
    text: `Open the example ${name}`,
    note: "replaces the script",
    run: () => ask({ ask: "load", from: { what: "example", name }, new: null }),
  })),
]);

/** The results: those that contain all words of the text. */
export function matching<T extends { readonly text: string; readonly note: string }>(all: readonly T[], text: string): readonly T[] {
  const words = text.toLowerCase().split(/\s+/);
  return all.filter(({ text, note }) => words.every((word) => `${text} ${note}`.toLowerCase().includes(word))).slice(0, SHOWN);
}

export function Search(): JSX.Element | null {
  if (!searching.value) return null;
  const results = (): readonly Found[] => matching(all.value, typed.value);
  const among = (found: readonly Found[]): number => Math.min(chosen.value, found.length - 1);
  const found = results();
  const at = among(found);
  const close = (): void => {
    searching.value = false;
    typed.value = "";
    chosen.value = 0;
  };
  const run = (what: Found | undefined): void => {
    close();
    what?.run();
  };
  const keyed = (event: KeyboardEvent): void => {
    // Keys may come faster than the page is rendered.
    const now = results();
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (step) chosen.value = (among(now) + step + now.length) % now.length;
    else if (event.key === "Enter") run(now[among(now)]);
    else return;
    event.preventDefault();
  };
  return (
    <dialog class="search" ref={(dialog) => void (dialog && !dialog.open && dialog.showModal())} aria-label="Search" onClose={close} onClick={(event) => event.target === event.currentTarget && close()}>
      <input
        role="combobox"
        list={undefined}
        aria-label="Search"
        aria-expanded="true"
        aria-controls="found"
        aria-activedescendant={found[at] && `found-${at}`}
        placeholder="Actions, objects, materials, examples"
        onInput={(event) => {
          typed.value = event.currentTarget.value;
          chosen.value = 0;
        }}
        onKeyDown={keyed}
      />
      <div id="found" role="listbox" aria-label="Results">
        {found.map((what, row) => (
          <div key={row} id={`found-${row}`} class="item" role="option" aria-selected={row === at} onClick={() => run(what)}>
            <span class="name">{what.text}</span>
            <span class="note">{what.note}</span>
          </div>
        ))}
      </div>
    </dialog>
  );
}
