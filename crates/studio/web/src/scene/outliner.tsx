// The outline: objects, groups, lights, cameras and materials of the script, by name.

import { computed, signal } from "@preact/signals";
import { Eye, EyeOff, type IconNode, Lock, LockOpen } from "lucide";
import type { JSX } from "preact";

import { actions } from "../actions";
import { nameOf } from "../inspector/words";
import { Icon } from "../parts/icon";
import { List } from "../parts/list";
import { Panel } from "../parts/panel";
import { visible } from "../parts/visible";
import type { LineState } from "../protocol";
import { ask, lines, select, selected, selection, state } from "../store";
import { iconOf } from "./icons";

const ROW = 28;

/** The lines that are listed. */
const listed = computed(() =>
  lines.value.flatMap((line, at) => (line.role && line.role !== "setting" ? [at] : [])),
);

/** The lines within the definition of a group. */
const grouped = computed(() => {
  const inside = new Set<number>();
  let open = false;
  lines.value.forEach((line, at) => {
    if (line.command === "End") open = false;
    if (open) inside.add(at);
    if (line.command === "Group") open = true;
  });
  return inside;
});

/** The line whose name is being written. */
const renaming = signal<number | null>(null);

/** The start of a range of rows that is selected with the shift key. */
const anchor = signal(0);

/** Gives a new field the focus; the same function each time, so that it is done once. */
const focused = (input: HTMLInputElement | null): void => {
  input?.focus();
  input?.select();
};

export function Outliner(): JSX.Element {
  const rows = listed.value;
  const main = selection.value.at(-1) ?? null;
  const active = main === null ? -1 : rows.indexOf(main);
  const go = (row: number, extend: boolean): void => {
    const line = rows[Math.max(0, Math.min(rows.length - 1, row))];
    if (line === undefined) return;
    select(extend ? [...selection.value, line] : [line]);
  };
  const keyed = (event: KeyboardEvent): void => {
    if ((event.target as HTMLElement).tagName === "INPUT") return;
    const main = selection.value.at(-1) ?? null;
    const active = main === null ? -1 : listed.value.indexOf(main);
    if (event.altKey && main !== null && (event.key === "ArrowUp" || event.key === "ArrowDown")) {
      (event.key === "ArrowDown" ? actions.later : actions.earlier).run();
    } else if (event.key === "ArrowDown") go(active + 1, event.shiftKey);
    else if (event.key === "ArrowUp") go(active < 0 ? 0 : active - 1, event.shiftKey);
    else if (event.key === "Home") go(0, false);
    else if (event.key === "End") go(rows.length - 1, false);
    else if (event.key === "F2" || event.key === "Enter") renaming.value = main;
    else if (event.key === "Delete") actions.remove.run();
    else if (event.key === "h") actions.hide.run();
    else if (event.key === "l") actions.lock.run();
    else if (event.ctrlKey && event.key === "d") actions.duplicate.run();
    else if (event.ctrlKey && event.key === "g") actions.group.run();
    else if (event.key === "k") actions.key.run();
    else if (event.key === "K") actions.autoKey.run();
    else if (event.key === "g") actions.ground.run();
    else if (event.key === "d") actions.drop.run();
    else if (event.key === "Escape") actions.none.run();
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <Panel name="outliner" title="Scene">
      <List
        class="list"
        count={rows.length}
        height={ROW}
        reveal={active < 0 ? null : active}
        role="listbox"
        aria-label="Objects, groups, lights, cameras and materials"
        aria-multiselectable="true"
        aria-activedescendant={active < 0 ? undefined : `line-${main}`}
        tabIndex={0}
        onKeyDown={keyed}
      >
        {(row) => {
          const at = rows[row];
          const line = at === undefined ? undefined : lines.value[at];
          return at === undefined || !line ? null : <Row at={at} row={row} line={line} rows={rows} />;
        }}
      </List>
    </Panel>
  );
}

interface RowProps {
  readonly at: number;
  readonly row: number;
  readonly line: LineState;
  readonly rows: readonly number[];
}

/** Whether a line is named by a word that other lines refer to, not by its comment. */
const isNamed = (line: LineState): boolean => (line.role === "material" || line.role === "group") && line.subject !== undefined;

/** The name of a line, or its command and number. */
export function titleOf(line: LineState, at: number): string {
  const named = isNamed(line) ? line.subject : (line.name ?? line.subject);
  return named ? visible(named) : `${line.role === "camera" ? "Camera" : nameOf(line.command ?? "")} in line ${at + 1}`;
}

function Row({ at, row, line, rows }: RowProps): JSX.Element {
  const isSelected = selected.value.has(at);
  const click = (event: MouseEvent): void => {
    if (event.shiftKey) {
      const [from, to] = [Math.min(anchor.value, row), Math.max(anchor.value, row)];
      select(rows.slice(from, to + 1));
    } else if (event.ctrlKey || event.metaKey) {
      const others = selection.value.filter((other) => other !== at);
      select(isSelected ? others : [...others, at]);
    } else {
      anchor.value = row;
      select([at]);
    }
  };
  const rename = (event: Event): void => {
    if (renaming.value === at) {
      renaming.value = null;
      ask({ ask: "rename", line: at, name: (event.currentTarget as HTMLInputElement).value });
    }
  };
  if (renaming.value === at) {
    return (
      <input
        class="rename"
        aria-label={`Name of ${line.command ?? ""}`}
        defaultValue={(isNamed(line) ? line.subject : line.name) ?? ""}
        ref={focused}
        onBlur={rename}
        onKeyDown={(event) => {
          event.stopPropagation();
          if (event.key === "Enter") rename(event);
          if (event.key === "Escape") renaming.value = null;
        }}
      />
    );
  }
  const named = isNamed(line) ? line.subject : (line.name ?? line.subject);
  const shown = titleOf(line, at);
  const isLocked = state.value?.locked.includes(at) ?? false;
  const states = [line.hidden && ", hidden", isLocked && ", locked"].filter(Boolean).join("");
  return (
    <div
      id={`line-${at}`}
      class={`item ${line.role ?? ""}${line.hidden ? " hidden" : ""}${grouped.value.has(at) ? " inside" : ""}`}
      role="option"
      aria-selected={isSelected}
      aria-label={`${named ? `${line.command ?? ""} ` : ""}${shown}${states}`}
      onClick={click}
      onDblClick={() => (renaming.value = at)}
    >
      {line.command && line.role && <Icon of={iconOf(line.command, line.role)} />}
      <span class={named ? "name" : "name none"}>{shown}</span>
      {line.role !== "material" && line.role !== "group" && (
        <>
          <Mark is={isLocked} icons={[LockOpen, Lock]} title="Lock or unlock (L)" run={() => ask({ ask: "lock", lines: [at] })} />
          <Mark is={line.hidden === true} icons={[Eye, EyeOff]} title="Hide or show (H)" run={() => ask({ ask: "hide", lines: [at] })} />
        </>
      )}
    </div>
  );
}

interface MarkProps {
  readonly is: boolean;
  readonly icons: readonly [IconNode, IconNode];
  readonly title: string;
  readonly run: () => void;
}

/** An eye or a lock, for the pointer; the list has keys for both. */
function Mark({ is, icons, title, run }: MarkProps): JSX.Element {
  const press = (event: Event): void => {
    event.stopPropagation();
    run();
  };
  return (
    <span class={is ? "state is" : "state"} title={title} aria-hidden="true" onClick={press} onDblClick={(event) => event.stopPropagation()}>
      <Icon of={icons[is ? 1 : 0]} />
    </span>
  );
}
