// A button for an action.

import type { JSX } from "preact";

import type { Action } from "./actions";

export function keyName(key: string): string {
  const names: Record<string, string> = { " ": "Space", ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓" };
  return key
    .split(/(?<=\+)(?=.)/)
    .map((part) => names[part] ?? (part.length === 1 ? part.toUpperCase() : part))
    .join("");
}

export function Button({ action, label }: { readonly action: Action; readonly label?: string }): JSX.Element {
  const keys = action.keys.map(keyName).join(" or ");
  return (
    <button type="button" title={`${action.title} (${keys})`} disabled={!(action.enabled?.() ?? true)} onClick={action.run}>
      {label ?? action.title}
    </button>
  );
}
