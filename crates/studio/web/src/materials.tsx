// The materials of the script and the starter materials, each as a small sphere rendered by the tracer.

import { computed } from "@preact/signals";
import type { JSX } from "preact";

import { ask, lines, playing, presets, select, selection, state } from "./store";

/** The lines that define materials, and a number that changes when one of them does. */
const defined = computed(() => {
  const found = lines.value.flatMap((line, at) => (line.role === "material" && line.subject && !line.hidden ? [{ at, name: line.subject, text: line.text }] : []));
  let mark = 0;
  for (const { text } of found) for (let at = 0; at < text.length; at += 1) mark = (Math.imul(mark, 31) + text.charCodeAt(at)) | 0;
  return { found, mark, moves: found.some(({ text }) => text.includes("(")) };
});

/** The selected lines that can have a material. */
const wearers = computed(() => selection.value.filter((at) => lines.value[at]?.role === "object"));

export function Materials(): JSX.Element {
  const { found, mark, moves } = defined.value;
  const now = state.value;
  const frame = moves && !playing.value ? (now?.time.number ?? 1) : 1;
  const given = wearers.value;
  const how = given.length > 0 ? "assign it to the selection" : "select it";
  return (
    <section class="panel materials" aria-labelledby="materials-title">
      <h2 id="materials-title">Materials</h2>
      {found.length > 0 && (
        <div class="spheres" role="group" aria-label="Of this script">
          {found.map(({ at, name }) => (
            <button
              type="button"
              key={name}
              class={selection.value.includes(at) ? "sphere chosen" : "sphere"}
              title={`${name}: ${how}`}
              onClick={() => (given.length > 0 ? ask({ ask: "surface", lines: given, material: name }) : select([at]))}
            >
              <img src={`material.png?${now?.file ?? 0},${at},${frame},${mark}`} alt="" width={48} height={48} />
              <span>{name}</span>
            </button>
          ))}
        </div>
      )}
      <details open={found.length === 0}>
        <summary>Starter materials</summary>
        <div class="spheres" role="group" aria-label="Starter materials">
          {presets.value.map((name) => (
            <button
              type="button"
              key={name}
              class="sphere"
              disabled={given.length === 0}
              title={given.length > 0 ? `${name}: assign it to the selection` : `${name}: select an object first`}
              onClick={() => ask({ ask: "preset", lines: given, preset: name })}
            >
              <img src={`preset.png?${name}`} alt="" width={48} height={48} loading="lazy" />
              <span>{name}</span>
            </button>
          ))}
        </div>
      </details>
    </section>
  );
}
