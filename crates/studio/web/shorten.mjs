// Names of properties that only the editor's packages use, which the build shortens: they are a tenth of the page.

import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";

const here = import.meta.dirname;
const modules = join(here, "node_modules");
const EDITOR = ["collab", "commands", "search", "state", "view"].map((name) => join(modules, "@codemirror", name, "dist/index.js"));
/** The libraries of the platform, in TypeScript's words. */
const PLATFORM = join(modules, "@typescript");
/** The packages and sources whose names stay. */
const OTHERS = [join(here, "src"), join(modules, "preact"), join(modules, "@preact")];
/** Names of the platform that TypeScript does not know: those of `EditContext` and of old browsers. */
const UNKNOWN =
  "attachedElements characterBounds characterBoundsRangeStart documentMode editContext EditContext getTextFormats rangeEnd rangeStart textFormats " +
  "underlineStyle underlineThickness updateCharacterBounds updateControlBounds updateSelection updateSelectionBounds updateText userAgentData brands";

const words = (text) => text.match(/[A-Za-z_$][\w$]*/g) ?? [];
const files = (folder, ending) =>
  readdirSync(folder, { recursive: true }).filter((name) => ending.test(name)).map((name) => join(folder, name));

/** The pattern of the names. One that is also in a text is left, because it may be used by that text. */
export function privateNames() {
  const editor = EDITOR.map((path) => readFileSync(path, "utf8")).join("\n").replace(/^\s*(\/\/|\/?\*).*$/gm, "");
  const quoted = (editor.match(/(["'`])(?:(?!\1)[^\\\n]|\\.)*\1/g) ?? []).flatMap(words);
  const kept = [...files(PLATFORM, /lib\.[\w.]+\.d\.ts$/), ...OTHERS.flatMap((folder) => files(folder, /\.(js|mjs|tsx?)$/))];
  const known = new Set([...quoted, ...words(UNKNOWN), ...kept.flatMap((path) => words(readFileSync(path, "utf8")))]);
  const used = new Set(Array.from(editor.matchAll(/\.([A-Za-z_$][\w$]*)/g), ([, name = ""]) => name));
  const own = [...used].filter((name) => name.length > 3 && !name.startsWith("__") && !known.has(name));
  return new RegExp(`^(${own.sort().join("|").replaceAll("$", "\\$")})$`);
}
