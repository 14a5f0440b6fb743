// A field for a number. Typed text stays until it is committed, whatever the server sends meanwhile. An invalid number is
// reported, and the current value is restored. A comma is a decimal point. A drag to a side changes the number.

import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { actions } from "../actions";
import type { FieldTable } from "../protocol";
import { gesture, notice } from "../store";

/** The pixels of a drag that change a number by a step. */
const SLIDE = 4;

interface Props {
  readonly label: string;
  /** The current value; `undefined` if the number is omitted. */
  readonly value: number | undefined;
  readonly least?: number;
  readonly most?: number;
  readonly whole?: boolean;
  /** The values to which steps and drags keep. Others can be typed, and the script says what is wrong with them. */
  readonly range?: Pick<FieldTable, "minimum" | "maximum" | "aboveMinimum">;
  /** Takes the gesture of a drag, too. */
  readonly set: (value: number, under: number | null) => void;
  /** Called at the end of a drag. Without it a drag sets only its last number. */
  readonly slid?: () => void;
}

/** A drag on a field, from its press. */
interface Slide {
  readonly x: number;
  readonly from: number;
  readonly under: number;
  to?: number;
}

/** Returns the number that a text is, or NaN. */
export function parsed(text: string): number {
  const typed = text.trim().replace("−", "-");
  const point = /^[^.,]*,[^.,]*$/.test(typed) ? typed.replace(",", ".") : typed;
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(point) ? Number(point) : Number.NaN;
}

export function NumberField({ label, value, least = -Number.MAX_VALUE, most = Number.MAX_VALUE, whole = false, range, set, slid }: Props): JSX.Element {
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
    else if (Number.isFinite(typed) && typed >= least && typed <= most && !(whole && !Number.isInteger(typed))) set(typed, null);
    else {
      notice.value = `${label}: expected a ${whole ? "whole " : ""}number${within(least, most)}.`;
      restore();
    }
  };
  // A step is a unit of the number's last digit but one: 0.1 for numbers around 1.
  const stepped = (from: number, steps: number): number => {
    const size = whole ? 1 : 10 ** Math.floor(Math.log10(Math.max(Math.abs(from), 0.1)) - 1 + 1e-9);
    const low = (range?.minimum ?? least) + (range?.aboveMinimum ? size : 0);
    return Math.max(Math.min(from, low), Math.min(range?.maximum ?? most, Number((from + steps * size).toPrecision(12))));
  };
  const slide = useRef<Slide | null>(null);
  const slideTo = (event: PointerEvent): void => {
    const [field, now] = [input.current, slide.current];
    const steps = now ? Math.round((event.clientX - now.x) / SLIDE) : 0;
    if (!field || !now || (steps === 0 && now.to === undefined)) return;
    // The field was focused by the press.
    field.blur();
    now.to = stepped(now.from, event.shiftKey ? 10 * steps : steps);
    field.value = String(now.to);
    if (slid) set(now.to, now.under);
  };
  const slideEnd = (): void => {
    const to = slide.current?.to;
    slide.current = null;
    if (to === undefined) return;
    if (slid) slid();
    else set(to, null);
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
      typing.current = false;
      set(stepped(value, event.shiftKey ? 10 * step : step), null);
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
      onPointerDown={(event) => {
        // In a field that is being typed in, the pointer selects text.
        if (event.button !== 0 || document.activeElement === input.current) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        slide.current = { x: event.clientX, from: value ?? 0, under: gesture() };
      }}
      onPointerMove={slideTo}
      onPointerUp={slideEnd}
      onPointerCancel={slideEnd}
      onKeyDown={keyed}
      onBlur={commit}
    />
  );
}

function within(least: number, most: number): string {
  const [from, to] = [least > -Number.MAX_VALUE, most < Number.MAX_VALUE];
  if (from && to) return ` from ${least} to ${most}`;
  return from ? ` from ${least}` : "";
}
