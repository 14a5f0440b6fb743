// The parameters of the selection, from the parser's tables: a new command needs no code here.

import type { JSX } from "preact";

import { actions } from "./actions";
import { Button } from "./button";
import type { Field, Inspected } from "./protocol";
import { wish } from "./keys";
import { NumberField } from "./number";
import { ask, commands, gesture, lines, select, selection, state } from "./store";

/** The gesture of the slider that is being moved. */
let sliding: number | null = null;

/** Three decimals are finer than a level of a picture. */
const round = (value: number): number => Math.round(value * 1000) / 1000;

function set(line: number, first: number, values: readonly number[], under: number | null): void {
  if (values.every(Number.isFinite)) ask({ ask: "set", line, first, values, gesture: under });
}

export function Inspector(): JSX.Element {
  const inspected = state.value?.inspected;
  const count = selection.value.length;
  const table = inspected ? commands.value.get(inspected.command) : undefined;
  const line = inspected ? lines.value[inspected.line] : undefined;
  const all = inspected && inspected.fields.length > 0 ? inspected.fields : (table?.fields ?? []);
  // After the name of a material there are no numbers.
  const fields = inspected?.material ? all.filter((field) => field.first < inspected.values.length - 1) : all;
  return (
    <section class="panel inspector" aria-labelledby="inspector-title">
      <h2 id="inspector-title">{table ? [table.name, inspected?.subject, line?.name && `(${line.name})`].filter(Boolean).join(" ") : count > 0 ? "No command" : "Nothing selected"}</h2>
      {count > 0 && (
        <div class="buttons">
          <Button action={actions.duplicate} />
          {actions.ungroup.enabled() ? <Button action={actions.ungroup} label="Ungroup" /> : <Button action={actions.group} label="Group" />}
          <Button action={actions.hide} label="Hide" />
          <Button action={actions.lock} label={selection.value.every((at) => state.value?.locked.includes(at)) ? "Unlock" : "Lock"} />
          <Button action={actions.earlier} label="Up the list" />
          <Button action={actions.later} label="Down the list" />
          <Button action={actions.ground} label="To the ground" />
          <Button action={actions.drop} label="Drop" />
          <Button action={actions.key} label="Key" />
          <Button action={actions.remove} />
        </div>
      )}
      {count > 1 && <p class="note">{count} lines are selected; moving, dropping and hiding concern all of them.</p>}
      {inspected && fields.map((field) => <FieldRow key={`${inspected.line}:${field.first}`} field={field} inspected={inspected} />)}
      {inspected?.material && <MaterialRow name={inspected.material} />}
      {!inspected && <p class="note">{count > 0 ? "The selection has no numbers to set; see the script." : "Click something in the picture or in the list."}</p>}
    </section>
  );
}

function MaterialRow({ name }: { readonly name: string }): JSX.Element {
  const at = lines.value.findIndex((line) => line.role === "material" && line.subject === name);
  return (
    <p class="note">
      Its surface is the material{" "}
      <button type="button" disabled={at < 0} onClick={() => select([at])}>
        {name}
      </button>
    </p>
  );
}

interface KeyProps {
  readonly inspected: Inspected;
  readonly numbers: readonly number[];
  readonly label: string;
}

/** Sets or removes keys of some numbers at the shown frame. */
function KeyButton({ inspected, numbers, label }: KeyProps): JSX.Element | null {
  const time = state.value?.time;
  if (!time || !inspected.canKey || (time.first === time.last && !numbers.some((at) => inspected.curves.includes(at)))) return null;
  const is = numbers.every((at) => inspected.keyed.includes(at));
  const changes = numbers.some((at) => inspected.curves.includes(at));
  return (
    <button
      type="button"
      class={changes ? "key changes" : "key"}
      aria-pressed={is}
      aria-label={`Key of ${label}, frame ${time.number}`}
      title={is ? "Remove the key" : "Set a key here"}
      onClick={() => wish({ do: "toggle", line: inspected.line, numbers })}
    >
      <span class="diamond" />
    </button>
  );
}

interface FieldProps {
  readonly field: Field;
  readonly inspected: Inspected;
}

function FieldRow({ field, inspected }: FieldProps): JSX.Element {
  const values = field.names.map((_, i) => inspected.values[field.first + i]);
  const isColor = (field.kind === "colour" || field.kind === "coefficients") && field.names.length === 3;
  const missing = values.every((value) => value === undefined);
  return (
    <fieldset class="field">
      <legend title={`${field.kind} in ${field.unit}; ${field.values}`}>
        {field.label}
        {field.optional && missing ? " (left out)" : ""}{" "}
        {field.names.length > 1 && <KeyButton inspected={inspected} numbers={field.names.map((_, i) => field.first + i)} label={field.label} />}
      </legend>
      {isColor && <Swatch field={field} inspected={inspected} values={values} />}
      {field.names.map((name, i) => (
        <NumberRow key={name} field={field} inspected={inspected} name={name} index={i} value={values[i]} slider={isColor || field.kind === "length"} />
      ))}
    </fieldset>
  );
}

interface SwatchProps extends FieldProps {
  readonly values: readonly (number | null | undefined)[];
}

function Swatch({ field, inspected, values }: SwatchProps): JSX.Element | null {
  if (values.includes(null)) return null;
  const byte = (value: number | null | undefined): string =>
    Math.round(255 * Math.max(0, Math.min(1, value ?? 0)))
      .toString(16)
      .padStart(2, "0");
  const pick = (text: string, under: number | null): void => {
    const channels = [1, 3, 5].map((at) => round(Number.parseInt(text.slice(at, at + 2), 16) / 255));
    set(inspected.line, field.first, channels, under);
  };
  return (
    <input
      type="color"
      aria-label={`${field.label}, as a colour`}
      value={`#${values.map(byte).join("")}`}
      onFocus={() => (sliding = gesture())}
      onInput={(event) => pick(event.currentTarget.value, sliding)}
      onChange={(event) => {
        pick(event.currentTarget.value, sliding);
        set(inspected.line, field.first, [], null);
        sliding = gesture();
      }}
    />
  );
}

interface NumberProps extends FieldProps {
  readonly name: string;
  readonly index: number;
  readonly value: number | null | undefined;
  readonly slider: boolean;
}

function NumberRow({ field, inspected, name, index, value, slider }: NumberProps): JSX.Element {
  const at = field.first + index;
  if (value === null) {
    return (
      <p class="number">
        <span>{name}</span> <em>is no number; see the script</em>
      </p>
    );
  }
  const label = field.names.length > 1 ? `${field.label}: ${name}` : field.label;
  const most = field.kind === "length" ? 2 * 10 ** Math.ceil(Math.log10(Math.max(Math.abs(value ?? 1), 1e-6))) : 1;
  return (
    <p class="number">
      <span aria-hidden="true">{name}</span>
      <KeyButton inspected={inspected} numbers={[at]} label={label} />
      <NumberField label={label} value={value === undefined ? undefined : round(value)} set={(asked) => set(inspected.line, at, [asked], null)} />
      {slider && (
        <input
          type="range"
          aria-label={`${label}, slider`}
          min={field.values === "greater than 0" ? most / 1000 : 0}
          max={most}
          step={most / 1000}
          value={value ?? 0}
          onPointerDown={() => (sliding = gesture())}
          onKeyDown={() => (sliding = sliding ?? gesture())}
          onInput={(event) => set(inspected.line, at, [round(event.currentTarget.valueAsNumber / most) * most], sliding)}
          onChange={() => {
            sliding = null;
            set(inspected.line, at, [], null);
          }}
        />
      )}
    </p>
  );
}
