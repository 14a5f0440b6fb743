// The results of the search.

/** The number of results. */
const SHOWN = 12;

/** The results: those that contain all words of the text. */
export function matching<T extends { readonly text: string; readonly note: string }>(all: readonly T[], text: string): readonly T[] {
  const words = text.toLowerCase().split(/\s+/);
  return all.filter(({ text, note }) => words.every((word) => `${text} ${note}`.toLowerCase().includes(word))).slice(0, SHOWN);
}
