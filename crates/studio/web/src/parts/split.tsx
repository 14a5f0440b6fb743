// The lines between columns and panels, which are dragged or moved by the arrow keys. A double click brings back the
// first size. The page remembers the sizes.

import type { JSX } from "preact";
import { useRef } from "preact/hooks";

import { remember, remembered } from "./memory";

interface Props {
  /** The variable of the style that has the size in pixels. */
  readonly name: string;
  readonly label: string;
  readonly first: number;
  readonly least: number;
  readonly most: number;
  /** Whether the size is along the page's height. */
  readonly upright?: boolean;
  /** Whether the sized panel comes after the line. */
  readonly after?: boolean;
}

const KEY_STEP = 16;

const style = (): CSSStyleDeclaration => document.documentElement.style;

function now({ name, first }: Props): number {
  return Number(style().getPropertyValue(`--${name}`).replace("px", "")) || first;
}

function set(of: Props, size: number): void {
  const { name, least, most } = of;
  const fitted = Math.round(Math.max(least, Math.min(most, size)));
  style().setProperty(`--${name}`, `${fitted}px`);
  remember(name, String(fitted));
}

export function Split(props: Props): JSX.Element {
  const { name, label, first, least, most, upright = false, after = false } = props;
  const way = after ? -1 : 1;
  // The page may be rendered again while the line is dragged.
  const held = useRef<{ readonly at: number; readonly size: number } | null>(null);
  const along = (event: PointerEvent): number => (upright ? event.clientY : event.clientX);
  const kept = Number(remembered(name, ""));
  if (kept >= least && kept <= most) style().setProperty(`--${name}`, `${kept}px`);
  const press = (event: PointerEvent & { readonly currentTarget: HTMLElement }): void => {
    event.currentTarget.setPointerCapture(event.pointerId);
    held.current = { at: along(event), size: now(props) };
  };
  const move = (event: PointerEvent): void => {
    if (held.current) set(props, held.current.size + way * (along(event) - held.current.at));
  };
  const keyed = (event: KeyboardEvent & { readonly currentTarget: HTMLElement }): void => {
    const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    set(props, now(props) + way * step * KEY_STEP);
    event.currentTarget.ariaValueNow = String(now(props));
  };
  return (
    <div
      class={upright ? "split upright" : "split"}
      role="separator"
      tabIndex={0}
      aria-label={label}
      aria-orientation={upright ? "horizontal" : "vertical"}
      aria-valuemin={least}
      aria-valuemax={most}
      aria-valuenow={kept || first}
      onPointerDown={press}
      onPointerMove={move}
      onPointerUp={() => (held.current = null)}
      onDblClick={() => set(props, first)}
      onKeyDown={keyed}
    />
  );
}
