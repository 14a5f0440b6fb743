// A button for an action: its icon or its label, and its keys in the tooltip.

import type { JSX } from "preact";

import type { Action } from "../actions";
import { Icon } from "./icon";

export function keyName(key: string): string {
  const names: Record<string, string> = { " ": "Space", ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓" };
  return key
    .split(/(?<=\+)(?=.)/)
    .map((part) => names[part] ?? (part.length === 1 ? part.toUpperCase() : part))
    .join("");
}

interface Props {
  readonly action: Action;
  /** The name of the button, if it is shorter than the title. */
  readonly label?: string;
  /** Whether the label is shown although there is an icon. */
  readonly wide?: boolean;
  readonly pressed?: boolean | undefined;
}

export function Button({ action, label, wide = false, pressed }: Props): JSX.Element {
  const keys = action.keys.map(keyName).join(" or ");
  const name = label ?? action.title;
  const { icon } = action;
  return (
    <button
      type="button"
      class={icon && !wide ? "icon-button" : ""}
      title={`${action.title} (${keys})`}
      aria-label={name}
      aria-pressed={pressed}
      disabled={!(action.enabled?.() ?? true)}
      onClick={action.run}
    >
      {icon && <Icon of={icon} />}
      {(!icon || wide) && <span>{name}</span>}
    </button>
  );
}
