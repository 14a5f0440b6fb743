// A field for a number. Typed text stays until it is committed, whatever the server sends meanwhile. An invalid number is
// reported, and the current value is restored.

import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { notice } from "./store";

interface Props {
  readonly label: string;
  /** The current value; `undefined` if the number is omitted. */
  readonly value: number | undefined;
  readonly least?: number;
  readonly most?: number;
  readonly whole?: boolean;
  readonly set: (value: number) => void;
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
  return (
    <input
      ref={input}
      type="number"
      step={whole ? 1 : "any"}
      aria-label={label}
      placeholder={value === undefined ? "left out" : ""}
      onInput={() => (typing.current = true)}
      onKeyDown={(event) => event.key === "Escape" && restore()}
      onBlur={() => (typing.current = false)}
      onChange={(event) => {
        const { value: typed, valueAsNumber: asked, validity } = event.currentTarget;
        typing.current = false;
        if (typed === "" && !validity.badInput) restore();
        else if (Number.isFinite(asked) && asked >= least && asked <= most && !(whole && !Number.isInteger(asked))) set(asked);
        else {
          notice.value = `${label}: expected a ${whole ? "whole " : ""}number${range(least, most)}.`;
          restore();
        }
      }}
    />
  );
}

function range(least: number, most: number): string {
  const [from, to] = [least > -Number.MAX_VALUE, most < Number.MAX_VALUE];
  if (from && to) return ` from ${least} to ${most}`;
  return from ? ` from ${least}` : "";
}
