// The parameters of the selection, from the parser's tables: a new command needs no code here.

import "./inspector.css";
import { signal } from "@preact/signals";
import { ChevronDown, ChevronRight, Plus, Settings2, Trash2 } from "lucide";
import type { JSX } from "preact";

import { actions } from "../actions";
import { Drawn } from "#drawn";
import { Button } from "../parts/button";
import { Icon } from "../parts/icon";
import { NumberField, type Slide } from "../parts/number";
import { Panel } from "../parts/panel";
import { visible } from "../parts/visible";
import type { FieldTable, Inspected } from "../protocol";
import { iconOf } from "../scene/icons";
import { sphereOf } from "../scene/materials";
import { titleOf } from "../scene/outliner";
import { ask, commands, gesture, language, lines, select, selection, state, tables } from "../store";
import { wish } from "../timeline/keys";
import { sunAngles, sunDirection } from "./sun";
import { meaningOf, nameOf, shortOf, unitOf, wordOf } from "./words";

/** The gesture of the slider that is being moved. */
let sliding: number | null = null;

/** The colours whose channels are shown, by their words. */
const unfolded = signal<ReadonlySet<string>>(new Set());

/** Three decimals are finer than a level of a picture. Small numbers have three digits. */
const round = (value: number): number => (Math.abs(value) < 0.1 ? Number(value.toPrecision(3)) : Math.round(value * 1000) / 1000);

/** Sets numbers of a field, from its `at`th on, in the shown line and in all selected lines that have this field. */
function set({ field, inspected }: FieldProps, at: number, values: readonly number[], under: number | null): void {
  if (!values.every(Number.isFinite)) return;
  const { line } = inspected;
  const others = values.length > 0 ? sameFields(field, inspected) : [];
  // Several lines are one step. An empty list of values ends it.
  const step = under ?? (others.length > 0 ? gesture() : null);
  for (const [other, first] of others) ask({ ask: "set", line: other, first: first + at, values, gesture: step });
  ask({ ask: "set", line, first: field.first + at, values, gesture: step });
  if (step !== under) ask({ ask: "set", line, first: field.first, values: [], gesture: null });
}

/** The other selected lines that have a field, each with the position of its first number. */
function sameFields(of: FieldTable, { line }: Inspected): readonly (readonly [number, number])[] {
  const own = lines.value[line];
  return selection.value.flatMap((at) => {
    const { command = "", role, text = "" } = lines.value[at] ?? {};
    // The clauses of a material decide what its numbers are.
    if (at === line || role === "material" || own?.role === "material") return [];
    const field = commands.value.get(command)?.fields.find(({ label, kind, names }) => label === of.label && kind === of.kind && names.length === of.names.length);
    return !field || (isSurface(field) && materialOf(at, text)) ? [] : [[at, field.first] as const];
  });
}

const isSurface = ({ kind }: FieldTable): boolean => kind === "coefficients";

/** The material that a line names in place of colours. */
function materialOf(line: number, text: string): string | undefined {
  const names = new Set(lines.value.slice(0, line).flatMap(({ role, subject }) => (role === "material" ? [subject] : [])));
  return text.split(/\s#(?![0-9a-f]{6}\b)/i)[0]?.split(/[\s,]+/).find((word) => names.has(word));
}

export function Inspector(): JSX.Element {
  const inspected = state.value?.inspected;
  const count = selection.value.length;
  const table = inspected ? commands.value.get(inspected.command) : undefined;
  const line = inspected ? lines.value[inspected.line] : undefined;
  const all = inspected && inspected.fields.length > 0 ? inspected.fields : (table?.fields ?? []);
  // After the name of a material there are no numbers.
  const fields = inspected?.material ? all.filter((field) => field.words ?? field.first < inspected.values.length - 1) : all;
  const allLocked = selection.value.every((at) => state.value?.locked.includes(at));
  const faults = state.value?.faults.some((fault) => fault.needsSamples && (!inspected || fault.line === inspected.line || table?.role === "light"));
  return (
    <Panel name="inspector" title={count > 0 ? "Object" : "Scene settings"}>
      {inspected && table && line && (
        <h3 class="subject">
          <Icon of={iconOf(table.name, table.role)} />
          <b>{(!line.name && visible(inspected.text ?? "")) || titleOf(line, inspected.line)}</b>
          <span class="note">{table.name}</span>
        </h3>
      )}
      {count > 0 && (
        <div class="group tools" role="group" aria-label="Selection">
          <Button action={actions.duplicate} />
          {actions.ungroup.enabled() ? <Button action={actions.ungroup} label="Ungroup" /> : <Button action={actions.group} label="Group" />}
          <Button action={actions.hide} label="Hide" />
          <Button action={actions.lock} label={allLocked ? "Unlock" : "Lock"} pressed={allLocked} />
          <Button action={actions.earlier} label="Up the list" />
          <Button action={actions.later} label="Down the list" />
          <Button action={actions.ground} label="To the ground" />
          <Button action={actions.drop} label="Drop" />
          <Button action={actions.key} label="Key" />
          <Button action={actions.remove} />
          <Button action={{ ...actions.none, icon: Settings2 }} label="Scene settings" />
        </div>
      )}
      {table?.role === "camera" && <Button action={actions.script} label="Look through" wide />}
      {inspected && table?.role === "material" && <Clauses inspected={inspected} />}
      {faults && (
        <p class="note soft">
          Soft shadows and blur need several samples per pixel; there is one.{" "}
          <button type="button" onClick={smooth}>
            Use 16 samples
          </button>
        </p>
      )}
      {count > 1 && (
        <p class="field">
          <span class="note">{count} are selected. A change is made in all that have the number.</span>
          <select aria-label="Align" value="" onChange={(event) => align(event.currentTarget)}>
            <option value="">Align…</option>
            {["x", "y", "z"].flatMap((name, axis) =>
              ALIGNMENTS.map(([how, label]) => (
                <option key={name + how} value={`${axis} ${how}`}>
                  {name}: {label}
                </option>
              )),
            )}
          </select>
        </p>
      )}
      {inspected && inspected.text !== null && <TextRow key={`${inspected.line}:${inspected.text}`} text={inspected.text} line={inspected.line} />}
      {inspected && fields.map((field) => <FieldRow key={`${inspected.line}:${field.first}`} field={field} inspected={inspected} />)}
      {inspected?.material && <MaterialRow name={inspected.material} line={inspected.line} />}
      {count === 0 ? <SceneSettings /> : !inspected && <p class="note">The selection has no numbers to set; see the script.</p>}
    </Panel>
  );
}

/** The words of a text. They change when the field is left, or with Control and Enter. */
function TextRow({ text, line }: { readonly text: string; readonly line: number }): JSX.Element {
  return (
    <p class="field">
      <span class="label">words</span>
      <textarea
        aria-label="words"
        rows={Math.min(8, text.split("\n").length)}
        defaultValue={text}
        onChange={(event) => ask({ ask: "words", line, text: event.currentTarget.value })}
        onKeyDown={(event) => {
          event.stopPropagation();
          if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) event.currentTarget.blur();
        }}
      />
    </p>
  );
}

function MaterialRow({ name, line }: { readonly name: string; readonly line: number }): JSX.Element {
  const names = lines.value.slice(0, line).flatMap(({ role, subject }) => (role === "material" && subject ? [subject] : []));
  const at = lines.value.findIndex((line) => line.role === "material" && line.subject === name);
  const objects = selection.value.filter((at) => lines.value[at]?.role === "object");
  return (
    <p class="field">
      <span class="label">material</span>
      <select aria-label="material" value={name} onChange={(event) => ask({ ask: "surface", lines: objects.includes(line) ? objects : [line], material: event.currentTarget.value })}>
        {names.map((name) => (
          <option key={name}>{name}</option>
        ))}
        <option value="">colours of its own</option>
      </select>
      <button type="button" disabled={at < 0} onClick={() => select([at])}>
        Edit
      </button>
    </p>
  );
}

/** The clauses of a material as switches, and its sphere. The switches stay where they are when the sphere comes. */
function Clauses({ inspected }: { readonly inspected: Inspected }): JSX.Element {
  const has = new Set(Object.values(inspected.words).map((word) => word?.toLowerCase()));
  return (
    <div class="card">
      <Drawn src={sphereOf(inspected.line)} width={72} height={72} />
      <div class="chips" role="group" aria-label="Clauses">
        {language.value?.clauses.map(({ name, about }) => (
          <button
            type="button"
            key={name}
            aria-pressed={has.has(name)}
            title={about}
            onClick={() => ask({ ask: "clause", line: inspected.line, clause: name })}
          >
            {nameOf(name)}
          </button>
        ))}
      </div>
    </div>
  );
}

const ALIGNMENTS = [
  ["least", "least ends"],
  ["middle", "middles"],
  ["most", "greatest ends"],
  ["distribute", "equal distances"],
] as const;

function align(menu: HTMLSelectElement): void {
  const [axis, how] = menu.value.split(" ");
  menu.value = "";
  const found = ALIGNMENTS.find(([name]) => name === how);
  if (found) ask({ ask: "align", lines: selection.value, axis: Number(axis), how: found[0] });
}

/** Several samples per pixel, as soft light needs. */
function smooth(): void {
  const now = state.value?.settings.find(({ command }) => command === "Samples");
  if (now) ask({ ask: "set", line: now.line, first: 0, values: [16], gesture: null });
  else ask({ ask: "add", command: "Samples", at: null });
}

/** The settings of the scene: those of its script, and those that can be added. */
function SceneSettings(): JSX.Element | null {
  const now = state.value;
  if (!now) return null;
  const settings = tables.value.filter(({ role, fields }) => role === "setting" && fields.length > 0);
  const camera = now.camera === null ? undefined : lines.value[now.camera]?.command;
  return (
    <>
      <p class="field">
        <span class="label">camera</span>
        <select aria-label="camera" value={camera ?? ""} onChange={(event) => ask({ ask: "camera", command: event.currentTarget.value })}>
          {!camera && <option value="">none</option>}
          {tables.value.map(
            ({ name, role }) =>
              role === "camera" && (
                <option key={name} value={name}>
                  {nameOf(name)}
                </option>
              ),
          )}
        </select>
        <button type="button" disabled={now.camera === null} onClick={() => select([now.camera ?? 0])}>
          Edit
        </button>
      </p>
      {settings.map(({ name, fields }) => {
        const inspected = now.settings.find(({ command }) => command === name);
        return (
          inspected && (
            <section key={name} class="setting" title={name} aria-label={nameOf(name)}>
              <h3 class="subject">
                <b>{nameOf(name)}</b>
                <button
                  type="button"
                  class="icon-button small"
                  aria-label={`Remove ${nameOf(name)}`}
                  title="Remove its line: the default is used"
                  onClick={() => ask({ ask: "remove", lines: [inspected.line] })}
                >
                  <Icon of={Trash2} />
                </button>
              </h3>
              {(inspected.fields[0] ? inspected.fields : fields).map((field) => (
                <FieldRow key={field.first} field={field} inspected={inspected} />
              ))}
            </section>
          )
        );
      })}
      <div class="chips" role="group" aria-label="Add a setting">
        {settings.map(
          ({ name }) =>
            !now.settings.some(({ command }) => command === name) && (
              <button type="button" key={name} title={`${name}: add its line`} onClick={() => ask({ ask: "add", command: name, at: null })}>
                <Icon of={Plus} />
                {nameOf(name)}
              </button>
            ),
        )}
      </div>
    </>
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
  readonly field: FieldTable;
  readonly inspected: Inspected;
}

function FieldRow({ field, inspected }: FieldProps): JSX.Element {
  if (field.words) return <WordRow field={field} inspected={inspected} />;
  const values = field.names.map((_, i) => inspected.values[field.first + i]);
  const isColor = (field.kind === "colour" || field.kind === "coefficients") && field.names.length === 3;
  const missing = field.optional && values.every((value) => value === undefined);
  const word = wordOf(field);
  const isSun = field.kind === "direction" && inspected.command === "Ilight";
  const isFolded = isColor || isSun;
  const isOpen = !isFolded || unfolded.value.has(word);
  const toggle = (): void => {
    const next = new Set(unfolded.value);
    if (!next.delete(word)) next.add(word);
    unfolded.value = next;
  };
  const help = [meaningOf(field.label), field.unit, field.values, missing && "not set"].filter(Boolean).join("; ");
  return (
    <div class={`field ${isFolded ? "colour" : ""} ${missing ? "missing" : ""} ${field.names.length > 1 ? "several" : ""}`} role="group" aria-label={word}>
      <span class="label" title={help}>
        {word}
      </span>
      {isFolded && (
        <>
          {isColor ? <Swatch field={field} inspected={inspected} values={values} /> : <span class="gap" />}
          <button type="button" class="icon-button small" aria-expanded={isOpen} aria-label={`Channels of ${word}`} title={isSun ? "x, y and z" : "Red, green and blue"} onClick={toggle}>
            <Icon of={isOpen ? ChevronDown : ChevronRight} />
          </button>
        </>
      )}
      {field.names.length > 1 && !field.fixed && <KeyButton inspected={inspected} numbers={field.names.map((_, i) => field.first + i)} label={word} />}
      {isOpen && (
        <div class="numbers">
          {field.names.map((name, i) => (
            <NumberRow key={name} field={field} inspected={inspected} name={name} index={i} value={values[i]} slider={isColor || field.names.length === 1} />
          ))}
        </div>
      )}
      {isSun && <SunRows field={field} inspected={inspected} values={values} />}
    </div>
  );
}

/** A parameter that is a word: a name, or one of the language's words. */
function WordRow({ field, inspected }: FieldProps): JSX.Element {
  const now = inspected.words[field.first]?.toLowerCase();
  // An omitted word is the first one.
  const word = field.words?.find((word) => word.toLowerCase() === now) ?? (field.optional ? field.words?.[0] : "");
  return (
    <p class="field">
      <span class="label">{wordOf(field)}</span>
      <select
        aria-label={wordOf(field)}
        value={word}
        onChange={(event) => ask({ ask: "word", line: inspected.line, number: field.first, word: event.currentTarget.value })}
      >
        {field.words?.map((word) => (
          <option key={word}>{word}</option>
        ))}
      </select>
    </p>
  );
}

interface SwatchProps extends FieldProps {
  readonly values: readonly (number | null | undefined)[];
}

function Swatch({ field, inspected, values }: SwatchProps): JSX.Element | null {
  if (values.includes(null)) return null;
  // Lights may be brighter than white: their swatch shows the hue, and keeps the brightness.
  const most = Math.max(1, ...values.map((value) => value ?? 0));
  const byte = (value: number | null | undefined): string =>
    Math.round((255 * Math.max(0, value ?? 0)) / most)
      .toString(16)
      .padStart(2, "0");
  const pick = (text: string, under: number | null): void => {
    const channels = [1, 3, 5].map((at) => round((most * Number.parseInt(text.slice(at, at + 2), 16)) / 255));
    set({ field, inspected }, 0, channels, under);
  };
  return (
    <input
      type="color"
      aria-label={`${wordOf(field)}, as a colour`}
      value={`#${values.map(byte).join("")}`}
      onFocus={() => (sliding = gesture())}
      onInput={(event) => pick(event.currentTarget.value, sliding)}
      onChange={(event) => {
        pick(event.currentTarget.value, sliding);
        set({ field, inspected }, 0, [], null);
        sliding = gesture();
      }}
    />
  );
}

interface SliderProps {
  readonly label: string;
  readonly least: number;
  readonly most: number;
  readonly step: number;
  readonly value: number;
  readonly slide: Slide;
}

function Slider({ label, least, most, step, value, slide }: SliderProps): JSX.Element {
  return (
    <input
      type="range"
      aria-label={`${label}, slider`}
      min={least}
      max={most}
      step={step}
      value={value}
      onPointerDown={() => (sliding = gesture())}
      onKeyDown={() => (sliding = sliding ?? gesture())}
      onInput={(event) => slide(Number(event.currentTarget.valueAsNumber.toPrecision(4)), sliding)}
      onChange={() => {
        sliding = null;
        slide(null, null);
      }}
    />
  );
}

/** A sun's direction as two angles. */
function SunRows({ field, inspected, values }: SwatchProps): JSX.Element | null {
  const [x, y, z] = values;
  if (x == null || y == null || z == null) return null;
  const now = sunAngles(x, y, z);
  const slide = (name: keyof typeof now): Slide => (to, under) => set({ field, inspected }, 0, to === null ? [] : sunDirection({ ...now, [name]: to }), under);
  return (
    <>
      {(["azimuth", "height"] as const).map((name) => (
        <p key={name} class="field number">
          <span class="label">{name}</span>
          <Slider
            label={`sun ${name}`}
            least={name === "azimuth" ? -180 : -90}
            most={name === "azimuth" ? 180 : 90}
            step={1}
            value={now[name]}
            slide={slide(name)}
          />
          <NumberField label={`sun ${name}`} value={now[name]} set={(to) => slide(name)(to, null)} slide={slide(name)} />
          <span class="unit">°</span>
        </p>
      ))}
    </>
  );
}

interface NumberProps extends FieldProps {
  readonly name: string;
  readonly index: number;
  readonly value: number | null | undefined;
  readonly slider: boolean;
}

/** The ends of a slider: those of the table, else a span around the value. */
function ends(field: FieldTable, value: number): readonly [number, number] {
  const least = field.minimum ?? (field.kind === "angle" ? -180 : 0);
  if (field.maximum !== undefined) return [least, field.maximum];
  if (field.kind === "colour" || field.kind === "coefficients") return [least, Math.max(1, value)];
  return [least, 2 * 10 ** Math.ceil(Math.log10(Math.max(Math.abs(value), 1e-3)))];
}

function NumberRow({ field, inspected, name, index, value, slider }: NumberProps): JSX.Element {
  const at = field.first + index;
  const word = wordOf(field);
  const short = shortOf(name, field.kind);
  const label = field.names.length > 1 ? `${word}: ${short}` : word;
  if (value === null) {
    return (
      <p class="number">
        <span>{short}</span> <em>is no number; see the script</em>
      </p>
    );
  }
  const [least, most] = ends(field, value ?? 1);
  const step = field.whole ? 1 : (most - least) / 1000;
  const isOpen = most - least <= 1e6;
  const slide: Slide = (to, under) => set({ field, inspected }, index, to === null ? [] : [to], under);
  return (
    <p class="number">
      {field.names.length > 1 && <span aria-hidden="true">{short}</span>}
      {slider && isOpen && (
        <Slider
          label={label}
          least={field.aboveMinimum ? least + step : least}
          most={most}
          step={step}
          value={value ?? 0}
          slide={slide}
        />
      )}
      <NumberField
        label={label}
        value={value === undefined ? undefined : round(value)}
        least={field.minimum}
        most={field.maximum}
        above={field.aboveMinimum}
        whole={field.whole}
        set={(asked) => slide(asked, null)}
        slide={slide}
      />
      {field.names.length === 1 && unitOf(field.unit) && <span class="unit">{unitOf(field.unit)}</span>}
      {!field.fixed && <KeyButton inspected={inspected} numbers={[at]} label={label} />}
    </p>
  );
}
