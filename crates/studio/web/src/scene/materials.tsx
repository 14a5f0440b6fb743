// The materials of the script and the starter materials, each as a small sphere rendered by the tracer.

import { computed, effect, signal } from "@preact/signals";
import { Plus } from "lucide";
import type { JSX } from "preact";

import { Drawn } from "#drawn";
import { Icon } from "../parts/icon";
import { Panel } from "../parts/panel";
import { ask, lines, playing, presets, select, selection, state } from "../store";

interface Defined {
  readonly at: number;
  readonly name: string;
  /** A number that changes with the material, also with another that it names. */
  readonly mark: number;
  readonly moves: boolean;
}

/** The milliseconds without a change after which the spheres are drawn anew. */
const REST = 300;

function hash(texts: readonly string[]): number {
  let mark = 0;
  for (const text of texts) for (let at = 0; at < text.length; at += 1) mark = (Math.imul(mark, 31) + text.charCodeAt(at)) | 0;
  return mark;
}

/** The materials of the script, without those that have an error. */
const found = computed((): readonly Defined[] => {
  const faulty = new Set(state.value?.faults.filter(({ error }) => error).map(({ line }) => line));
  const all = lines.value.flatMap((line, at) =>
    line.role === "material" && line.subject && !line.hidden && !faulty.has(at) ? [{ at, name: line.subject, text: line.text }] : [],
  );
  const texts = new Map(all.map(({ name, text }) => [name, text]));
  return all.map(({ at, name, text }) => {
    const named = text.split(/[\s,]+/).flatMap((word) => texts.get(word) ?? []);
    return { at, name, mark: hash([text, ...named]), moves: text.includes("(") };
  });
});

/** The materials as they are shown: those of a moment without changes. */
const defined = signal<readonly Defined[]>([]);

let timer = 0;
effect(() => {
  const now = found.value;
  const old = defined.peek();
  // A change that was taken back is not shown later.
  clearTimeout(timer);
  if (now.length === old.length && now.every((of, at) => of.mark === old[at]?.mark && of.at === old[at].at && of.name === old[at].name)) return;
  timer = setTimeout(() => (defined.value = now), old.length === 0 ? 0 : REST);
});

/** The selected lines that can have a material. */
export const wearers = computed(() => selection.value.filter((at) => lines.value[at]?.role === "object"));

/** The address of the picture of a material's sphere. */
export function sphereOf(at: number): string | undefined {
  const found = defined.value.find((material) => material.at === at);
  const frame = playing.value || !found?.moves ? 1 : (state.value?.time.number ?? 1);
  return found && `material.png?${state.value?.file ?? 0},${at},${frame},${found.mark}`;
}

/** Lets a material be dragged onto an object. */
const carries = (kind: string, name: string) => ({
  draggable: true,
  onDragStart: (event: DragEvent): void => event.dataTransfer?.setData("text/plain", `${kind} ${name}`),
});

export function Materials(): JSX.Element {
  const shown = defined.value;
  const given = wearers.value;
  const how = given.length > 0 ? "assign it to the selection" : "select it";
  return (
    <Panel name="materials" title="Materials">
      <button type="button" onClick={() => ask({ ask: "add", command: "Material", at: null })}>
        <Icon of={Plus} />
        New material
      </button>
      {shown.length > 0 && (
        <div class="spheres" role="group" aria-label="Of this script">
          {shown.map(({ at, name }) => (
            <button
              type="button"
              key={name}
              class={selection.value.includes(at) ? "sphere chosen" : "sphere"}
              title={`${name}: ${how}, or drag it onto an object`}
              {...carries("Material", name)}
              onClick={() => (given.length > 0 ? ask({ ask: "surface", lines: given, material: name }) : select([at]))}
            >
              <Drawn src={sphereOf(at)} width={48} height={48} />
              <span>{name}</span>
            </button>
          ))}
        </div>
      )}
      <details open={shown.length === 0}>
        <summary>Starter materials</summary>
        <div class="spheres" role="group" aria-label="Starter materials">
          {presets.value.map((name) => (
            <button
              type="button"
              key={name}
              class="sphere"
              title={given.length > 0 ? `${name}: assign it to the selection` : `${name}: drag it onto an object, or select one first`}
              {...carries("Preset", name)}
              onClick={() => given.length > 0 && ask({ ask: "preset", lines: given, preset: name })}
            >
              <Drawn src={`preset.png?${name}`} width={48} height={48} loading="lazy" />
              <span>{name}</span>
            </button>
          ))}
        </div>
      </details>
    </Panel>
  );
}
