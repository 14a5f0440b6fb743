// The words of a line and the parameters to which they belong, from the table of the language that the server sends.

import { computed } from "@preact/signals";

import type { LanguageEntry, LanguageParameter } from "../protocol";
import { language, lines } from "../store";

export type Kind = "command" | "unknown" | "name" | "word" | "number" | "curve" | "comment";

export interface Word {
  readonly from: number;
  readonly to: number;
  readonly text: string;
  readonly kind: Kind;
  /** The command or the clause to which the word belongs. */
  readonly entry: LanguageEntry | null;
  /** The parameter of a number, and the name of the number. */
  readonly parameter: LanguageParameter | null;
  readonly number: string;
}

/** What may come at a place of a line. */
export interface Slot {
  readonly entry: LanguageEntry | null;
  readonly parameter: LanguageParameter | null;
  readonly number: string;
  readonly names: readonly string[];
  readonly clauses: boolean;
}

/** The entries by their names; of two with the same name the first. */
const byName = (entries: readonly LanguageEntry[]): ReadonlyMap<string, LanguageEntry> =>
  new Map([...entries].reverse().map((entry) => [entry.name.toLowerCase(), entry]));

const commands = computed(() => byName(language.value?.commands ?? []));
const quoting = computed(() => byName((language.value?.commands ?? []).filter(({ subject }) => subject?.role === "quotes")));
const clauses = computed(() => byName(language.value?.clauses ?? []));

/** The names that the script defines, by kind: `material` or `group`. */
export const defined = computed(() => {
  const found: Record<string, string[]> = { material: [], group: [] };
  for (const line of lines.value) if (line.subject && (line.role === "material" || line.role === "group")) found[line.role]?.push(line.subject);
  return found;
});

const WORD = /"(?:\\.|[^"\\])*"?|#[\da-f]{6}(?![^\s,#():])|#.*|\([^)#]*\)?|[^\s,(#]+/gi;

/** Whether a colour such as `#ff8000` may stand after some numbers of a command or clause. */
function takesColor(entry: LanguageEntry | null, given: number, behindColor: boolean): boolean {
  let first = 0;
  for (const parameter of entry?.parameters ?? []) {
    const isColor = parameter.names.length === 3 && (parameter.kind === "colour" || parameter.kind === "coefficients");
    // A colour may stand in place of the surface of a mesh or a text.
    const isSurface = entry?.subject?.role === "quotes" && parameter.names[0] === entry.material_instead_from;
    const mayStand = parameter.presence === "required" || isSurface;
    if (first === given && isColor && (behindColor || mayStand)) return true;
    first += parameter.names.length;
  }
  return false;
}

/** The next slot after some numbers of a command or clause. */
function slot(entry: LanguageEntry, given: number): Slot {
  let at = given;
  const reached: string[] = [];
  for (const parameter of entry.parameters) {
    for (const number of parameter.names) {
      reached.push(number);
      if (at === 0) {
        const from = entry.material_instead_from;
        // The name of a material may come in place of the first of these numbers alone.
        const word = given === 0 && entry.word_instead ? [entry.word_instead] : [];
        const names = from === number ? (defined.value["material"] ?? []) : (parameter.words ?? word);
        return { entry, parameter, number, names, clauses: false };
      }
      at -= 1;
    }
  }
  const names = entry.ends_with ? (defined.value[entry.ends_with] ?? []) : [];
  return { entry, parameter: null, number: "", names, clauses: false };
}

const NOTHING: Slot = { entry: null, parameter: null, number: "", names: [], clauses: false };

/** The words of a line, and what may come after the last of them. */
export function read(text: string): { readonly words: readonly Word[]; readonly next: Slot } {
  const words: Word[] = [];
  let next: Slot = NOTHING;
  let isMaterial = false;
  let given = 0;
  let needsName = false;
  let behindColor = false;
  for (const { 0: word, index } of text.matchAll(WORD)) {
    const add = (kind: Kind, of: Slot = NOTHING): void => {
      words.push({ from: index, to: index + word.length, text: word, kind, entry: of.entry, parameter: of.parameter, number: of.number });
    };
    if (word.startsWith("#")) {
      const isColor = word.length === 7 && !needsName && takesColor(next.entry, given, behindColor);
      if (!isColor) {
        words.push({ from: index, to: text.length, text: text.slice(index), kind: "comment", entry: null, parameter: null, number: "" });
        break;
      }
      add("number", next);
      given += 3;
      behindColor = true;
      next = next.entry ? { ...slot(next.entry, given), clauses: isMaterial } : NOTHING;
      continue;
    }
    behindColor = false;
    if (words.length === 0) {
      const bare = word.replace(/^\uFEFF/, "");
      const entry = commands.value.get(bare.toLowerCase()) ?? null;
      add(entry ? "command" : "unknown", { ...NOTHING, entry });
      if (!entry) continue;
      isMaterial = clauses.value.size > 0 && entry.subject?.role === "defines" && entry.subject.of === "material";
      needsName = entry.subject !== undefined;
      const known = entry.subject?.role === "refers" ? (defined.value[entry.subject.of] ?? []) : [];
      next = needsName ? { ...NOTHING, entry, names: known } : slot(entry, 0);
      continue;
    }
    const first = words[0];
    const quotes = words.length === 1 && first && word.startsWith('"') ? quoting.value.get(first.text.toLowerCase()) : undefined;
    if (quotes && !needsName) {
      words[0] = { ...first!, entry: quotes };
      next = slot(quotes, 0);
      add("name", { ...NOTHING, entry: quotes });
      continue;
    }
    if (needsName) {
      needsName = false;
      add("name", next);
      next = isMaterial ? { ...NOTHING, entry: next.entry, clauses: true } : next.entry ? slot(next.entry, 0) : NOTHING;
      continue;
    }
    const clause = isMaterial ? clauses.value.get(word.toLowerCase()) : undefined;
    if (clause) {
      add("word", { ...NOTHING, entry: clause });
      // A name in quotes comes before the first parameter.
      given = clause.subject ? -1 : 0;
      next = { ...slot(clause, given), clauses: true };
      continue;
    }
    const isNumber = /^[-+.\d]/.test(word) && !Number.isNaN(Number(word));
    add(word.startsWith("(") ? "curve" : isNumber ? "number" : "name", next);
    if (next.entry) {
      given += 1;
      next = isNumber || given === 0 || next.parameter?.words || word.startsWith("(") ? { ...slot(next.entry, given), clauses: isMaterial } : { ...NOTHING, clauses: isMaterial };
    }
  }
  return { words, next };
}

/** The commands, clauses, modes and names that may stand in place of the word that ends at a column. */
export function choices(text: string, column: number): readonly { readonly label: string; readonly about: string }[] {
  const table = language.value;
  if (!table) return [];
  const before = text.slice(0, column);
  if (read(before).words.at(-1)?.kind === "comment") return [];
  const open = before.lastIndexOf("(");
  if (open > before.lastIndexOf(")")) return table.curve_modes.map(({ name, about }) => ({ label: name, about }));
  const start = before.search(/[^\s,(]*$/);
  const { words, next } = read(before.slice(0, start));
  if (words.length === 0) return [...commands.value.values()].reverse().map(({ name, about }) => ({ label: name, about }));
  const named = next.names.map((label) => ({ label, about: next.entry?.ends_with ?? next.entry?.subject?.of ?? "" }));
  const clause = next.clauses ? table.clauses.map(({ name, about }) => ({ label: name, about })) : [];
  return [...named, ...clause];
}

/** The range of a parameter in words. */
export function range(parameter: LanguageParameter): string {
  const more = [parameter.kind, parameter.unit, parameter.range].filter((text) => text && text !== "none");
  return [...new Set(more)].join(", ");
}
