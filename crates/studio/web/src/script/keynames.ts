// Names of keys by their codes, for keyboards of other alphabets, where Ctrl and a key means that of a Latin keyboard. This
// replaces the table of CodeMirror, which is for old browsers too.

export const base: Record<number, string> = {};
export const shift: Record<number, string> = {};

const take = (first: number, plain: string, shifted: string): void =>
  [...plain].forEach((key, at) => {
    base[first + at] = key;
    shift[first + at] = shifted[at] ?? key;
  });

const LETTERS = "abcdefghijklmnopqrstuvwxyz";
take(48, "0123456789", ")!@#$%^&*(");
take(65, LETTERS, LETTERS.toUpperCase());
take(96, "0123456789*+", "0123456789*+");
take(109, "-./", "-./");
take(186, ";=,-./`", ":+<_>?~");
take(219, "[\\]'", '{|}"');
// Firefox has codes of its own for these.
take(59, ";", ":");
take(61, "=", "+");
take(173, "-", "_");

/** Returns the name of a pressed key. On macOS, Command hides what Shift makes of a key. */
export function keyName(event: KeyboardEvent): string {
  const hides = event.metaKey && event.shiftKey && !event.ctrlKey && !event.altKey && navigator.platform.includes("Mac");
  const known = !hides && event.key !== "Unidentified";
  return known ? event.key : ((event.shiftKey ? shift : base)[event.keyCode] ?? event.key);
}
