// A field for a number. Typed text stays until it is committed, whatever the server sends meanwhile. An invalid number is
// reported, and the current value is restored. A comma is a decimal point.

import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { actions } from "../actions";
import { notice } from "../store";

interface Props {
  readonly label: string;
  /** The current value; `undefined` if the number is omitted. */
  readonly value: number | undefined;
  readonly least?: number;
  readonly most?: number;
  readonly whole?: boolean;
  readonly set: (value: number) => void;
}

/** Returns the number that a text is, or NaN. */
export function parsed(text: string): number {
  const typed = text.trim().replace("−", "-");
  const point = /^[^.,]*,[^.,]*$/.test(typed) ? typed.replace(",", ".") : typed;
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(point) ? Number(point) : Number.NaN;
}

export function NumberField({ label, value, least = -Number.MAX_VALUE, most = Number.MAX_VALUE, whole = false, set }: Props): JSX.Element {
  const input = useRef<HTMLInputElement>(null);
  const typing = useRef(false);
  const text = value === undefined ? "" : String(value);
  const restore = (): void => {
    typing.current = false;
    if (input.current) input.current.value = text;
  };
  useEffect(() => {
    const field = input.current;
    if (typing.current || !field || field.value === text) return;
    field.value = text;
    // The text is no longer selected. Select it again, so that the next typed text replaces it.
    if (document.activeElement === field) field.select();
  });
  const commit = (): void => {
    const field = input.current;
    if (!field || !typing.current) return;
    typing.current = false;
    const typed = parsed(field.value);
    if (field.value === text) return;
    if (field.value.trim() === "") restore();
    else if (Number.isFinite(typed) && typed >= least && typed <= most && !(whole && !Number.isInteger(typed))) set(typed);
    else {
      notice.value = `${label}: expected a ${whole ? "whole " : ""}number${range(least, most)}.`;
      restore();
    }
  };
  const keyed = (event: KeyboardEvent): void => {
    const step = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    const isUndo = (event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z";
    if (event.key === "Escape") restore();
    else if (event.key === "Enter") {
      commit();
      input.current?.select();
    } else if (isUndo && typing.current) restore();
    else if (isUndo) (event.shiftKey ? actions.redo : actions.undo).run();
    else if (step && value !== undefined) {
      // A step is a unit of the number's last digit but one: 0.1 for numbers around 1.
      const size = whole ? 1 : 10 ** Math.floor(Math.log10(Math.max(Math.abs(value), 0.1)) - 1 + 1e-9);
      const next = Number((value + step * size * (event.shiftKey ? 10 : 1)).toPrecision(12));
      typing.current = false;
      set(Math.max(least, Math.min(most, next)));
    } else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <input
      ref={input}
      type="text"
      class="number-field"
      inputMode="decimal"
      autocomplete="off"
      role="spinbutton"
      aria-valuenow={value ?? 0}
      aria-label={label}
      placeholder={value === undefined ? "–" : ""}
      onInput={() => (typing.current = true)}
      onFocus={(event) => event.currentTarget.select()}
      onKeyDown={keyed}
      onBlur={commit}
    />
  );
}

function range(least: number, most: number): string {
  const [from, to] = [least > -Number.MAX_VALUE, most < Number.MAX_VALUE];
  if (from && to) return ` from ${least} to ${most}`;
  return from ? ` from ${least}` : "";
}
