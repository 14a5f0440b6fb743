// Search over everything: actions with their keys, outputs, what can be added, the lines of the script, starter materials
// and scripts.

import { computed, signal } from "@preact/signals";
import type { JSX } from "preact";

import { type Action, actions } from "../actions";
import { nameOf } from "../inspector/words";
import { keyName } from "../parts/button";
import { visible } from "../parts/visible";
import { wearers } from "../scene/materials";
import { titleOf } from "../scene/outliner";
import { showFile } from "../script/panel";
import { ask, examples, files, lines, notice, presets, searching, select, tables } from "../store";
import { matching } from "./matching";

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
  ...lines.value.flatMap((line, at) =>
    line.role && line.role !== "setting" ? [{ text: titleOf(line, at), note: line.command ?? "", run: () => select([at]) }] : [],
  ),
  ...presets.value.map((preset) => ({
    text: `Material ${preset}`,
    note: "starter material",
    run: () => (wearers.value.length > 0 ? ask({ ask: "preset", lines: wearers.value, preset }) : void (notice.value = "Select objects first, which get the material.")),
  })),
  ...files.value.map(({ name }, file) => ({ text: visible(name), note: "script", run: () => showFile(file) })),
  ...examples.value.map((name) => ({
    text: `Open the example ${name}`,
    note: "replaces the script",
    run: () => ask({ ask: "load", from: { what: "example", name }, new: null }),
  })),
]);

/** The buttons of the upper bar that are no actions: outputs, files and the colours. */
const buttons = (): readonly Found[] =>
  [...document.querySelectorAll<HTMLElement>(".result :is(a, button:enabled:not(.more)), .bar :is(button[aria-label='File'], button[aria-label='Light or dark'])")].map((of) => ({
    text: of.ariaLabel ?? of.textContent ?? "",
    note: of.closest(".result") ? "output" : of.title,
    run: () => of.click(),
  }));

export function Search(): JSX.Element | null {
  if (!searching.value) return null;
  const results = (): readonly Found[] => matching([...all.value, ...buttons()], typed.value);
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
        placeholder="Actions, objects, materials, outputs, scripts"
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
