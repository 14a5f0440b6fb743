// The characters that a caret goes over at once, as the browser knows them. CodeMirror has a table of its own, which this
// replaces.

const segmenter = new Intl.Segmenter();

/** The text that was read last: a line is read many times. */
let last = "";
let segments = segmenter.segment(last);

/** Returns the next boundary after a position, or the last one before it. */
export function findClusterBreak(text: string, at: number, forward = true): number {
  if (forward ? at >= text.length : at <= 1) return forward ? text.length : 0;
  const from = forward ? at : at - 1;
  // No mark joins a character of ASCII to one.
  const [code, other] = [text.charCodeAt(from), text.charCodeAt(forward ? from + 1 : from - 1)];
  if (code < 128 && !(other >= 128)) return forward ? from + 1 : from;
  if (last !== text) {
    last = text;
    segments = segmenter.segment(text);
  }
  const found = segments.containing(from);
  if (!found) return at;
  return forward ? found.index + found.segment.length : found.index;
}
