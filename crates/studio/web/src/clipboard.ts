// Copy and paste of objects as text of the language, so that they go from one window to another and into any editor.

import type { LineState } from "./protocol";
import { ask, lines, selection } from "./store";

/** The text of lines, with the materials and groups that they name before them. */
export function scriptOf(all: readonly LineState[], chosen: readonly number[]): string {
  const taken = new Set<number>();
  const take = (at: number): void => {
    const line = all[at];
    if (!line || taken.has(at)) return;
    taken.add(at);
    const words = new Set(line.text.split("#")[0]?.split(/[\s,]+/));
    all.slice(0, at).forEach(({ role, subject }, other) => {
      if (!subject || !words.has(subject)) return;
      if (role === "material" && line.role !== "use") take(other);
      if (role !== "group" || line.role !== "use") return;
      for (let inner = other; inner < at; inner += 1) {
        take(inner);
        if (all[inner]?.command === "End") break;
      }
    });
  };
  chosen.forEach(take);
  return [...taken].sort((a, b) => a - b).map((at) => `${all[at]?.text ?? ""}\n`).join("");
}

/** Whether a clipboard's event is for the scene, not for a field or the script. */
const isOurs = (event: ClipboardEvent): boolean =>
  !document.querySelector("dialog[open]") && !(event.target as HTMLElement).closest("input, select, textarea, .code");

export function listenClipboard(): void {
  const copy = (event: ClipboardEvent): void => {
    if (!isOurs(event) || selection.value.length === 0) return;
    event.clipboardData?.setData("text/plain", scriptOf(lines.value, selection.value));
    event.preventDefault();
    if (event.type === "cut") ask({ ask: "remove", lines: selection.value });
  };
  addEventListener("copy", copy);
  addEventListener("cut", copy);
  addEventListener("paste", (event) => {
    const text = event.clipboardData?.getData("text/plain");
    if (text && isOurs(event)) ask({ ask: "paste", text });
  });
}
