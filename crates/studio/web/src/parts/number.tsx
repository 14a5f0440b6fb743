// A field for a number. Typed text stays until it is committed, whatever the server sends meanwhile. An invalid number is
// reported, and the current value is restored. A comma is a decimal point. The pointer changes the value of a field that has
// not the focus by a drag to the sides: finely with Shift, and Escape gives up.

import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { actions } from "../actions";
import { ask, gesture, notice } from "../store";

/** Takes the values of a gesture, which are one step, and `null` at its end. */
export type Slide = (value: number | null, under: number | null) => void;

/** The pixels by which the pointer moves in a click. */
const CLICK = 3;

/** The least step above a limit that is no value itself. */
const ABOVE = 1e-4;

interface Props {
  readonly label: string;
  /** The current value; `undefined` if the number is omitted. */
  readonly value: number | undefined;
  readonly least?: number | undefined;
  readonly most?: number | undefined;
  /** The least value is no value itself. */
  readonly above?: boolean;
  readonly whole?: boolean;
  readonly set: (value: number) => void;
  /** Sets values while the pointer drags. Without it a drag does nothing. */
  readonly slide?: Slide;
}

/** A unit of the number's last digit but one: 0.1 for numbers around 1. */
const stepOf = (value: number): number => 10 ** Math.floor(Math.log10(Math.abs(value)) - 1 + 1e-9);

/** Returns the number that a text is, or NaN. */
export function parsed(text: string): number {
  const typed = text.trim().replace("−", "-");
  const point = /^[^.,]*,[^.,]*$/.test(typed) ? typed.replace(",", ".") : typed;
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(point) ? Number(point) : Number.NaN;
}

export function NumberField({ label, value, least = -Number.MAX_VALUE, most = Number.MAX_VALUE, above = false, whole = false, set, slide }: Props): JSX.Element {
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
    else if (Number.isFinite(typed) && (above ? typed > least : typed >= least) && typed <= most && !(whole && !Number.isInteger(typed))) set(typed);
    else {
      notice.value = `${label}: expected a ${whole ? "whole " : ""}number${range(least, most, above)}.`;
      restore();
    }
  };
  const within = (value: number): number => Number(Math.max(above ? least + ABOVE : least, Math.min(most, value)).toPrecision(12));
  const press = (event: PointerEvent): void => {
    const field = input.current;
    if (!field || !slide || event.button || document.activeElement === field) return;
    // What is typed in another field is committed.
    (document.activeElement as HTMLElement | null)?.blur();
    field.setPointerCapture(event.pointerId);
    const ends = new AbortController();
    const unit = (whole ? 1 : stepOf(value || 1)) / 5;
    let [last, exact, under] = [event.clientX, value ?? 0, 0];
    const end = ({ type }: Event): void => {
      ends.abort();
      if (under) slide(null, null);
      else if (type === "pointerup") field.focus();
    };
    const on = { signal: ends.signal, capture: true };
    field.addEventListener("pointerup", end, on);
    field.addEventListener("pointercancel", end, on);
    field.addEventListener("pointermove", ({ clientX, shiftKey }) => {
      if (!under && Math.abs(clientX - last) < CLICK) return;
      under ||= gesture();
      const size = shiftKey ? unit / 10 : unit;
      exact = within(exact + (clientX - last) * size);
      last = clientX;
      slide(within(Math.round(exact / (whole ? 1 : size)) * (whole ? 1 : size)), under);
    }, on);
    addEventListener("keydown", (key) => {
      key.preventDefault();
      key.stopPropagation();
      if (key.key !== "Escape" || !under) return;
      ends.abort();
      ask({ ask: "give-up", gesture: under });
    }, on);
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
      const size = whole ? 1 : stepOf(Math.max(Math.abs(value), 0.1));
      typing.current = false;
      set(within(value + step * size * (event.shiftKey ? 10 : 1)));
    } else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <input
      ref={input}
      type="text"
      class={slide ? "number-field slides" : "number-field"}
      inputMode="decimal"
      autocomplete="off"
      role="spinbutton"
      aria-valuenow={value ?? 0}
      aria-label={label}
      placeholder={value === undefined ? "–" : ""}
      onInput={() => (typing.current = true)}
      onPointerDown={press}
      onMouseDown={(event) => slide && document.activeElement !== event.currentTarget && event.preventDefault()}
      onFocus={(event) => event.currentTarget.select()}
      onKeyDown={keyed}
      onBlur={commit}
    />
  );
}

function range(least: number, most: number, above: boolean): string {
  const [from, to] = [least > -Number.MAX_VALUE, most < Number.MAX_VALUE];
  const begin = ` ${above ? "above" : "from"} ${least}`;
  if (from && to) return `${begin} to ${most}`;
  return from ? begin : "";
}
