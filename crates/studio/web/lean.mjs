// The editor's packages without what the page's browsers do not need: tables that the browser has itself, code for
// browsers without `Intl.Segmenter`, and colours that the page's own theme replaces.

import { join } from "node:path";

const own = (name) => join(import.meta.dirname, "src/script", name);

/** The sources that replace whole packages. */
export const REPLACED = { "@marijn/find-cluster-break": own("clusters.ts"), "w3c-keyname": own("keynames.ts") };

/** Rules of a theme for light or dark editors, with those inside of them. */
const COLOURS = /^ {4}"&(light|dark)[^"]*": (\{[^{}\n]*\}|\{\n[^]*?\n {4}\}),?$/gm;

/** What the packages say of wrong calls is for those who write an editor; the place of the error says it, too. */
const WORDS_OF_ERRORS = [/new (Range)?Error\((?:"[^"]*"|`[^`]*`)\)/g, "new $1Error()"];

/** Replacements in a package's text. Each must be found: a new version of the package may have moved its code. */
const CUTS = {
  "@codemirror/view": [
    [/^const ie(_edge|_upto10|_11up)? = .*;$/gm, ""],
    [/^const brokenClipboardAPI = [^;]+;$/gm, ""],
    [/^const (BadMouseDetail|useCharData) = .*;$/gm, ""],
    [/!ie && /g, ""],
    [/^ {4}ie(_version)?(: .*)?,$/gm, ""],
    [/\(browser\.ie \|\| browser\.chrome\)/g, "browser.chrome"],
    [/browser\.ie && browser\.ie_version <= 11 \|\| /g, ""],
    [/\b(BadMouseDetail|brokenClipboardAPI|useCharData)\b/g, "false"],
    [/typeof (ResizeObserver|IntersectionObserver) == "function"/g, "true"],
    [/^ {4}tabSize: .*$/gm, '    tabSize: "tab-size"'],
    [COLOURS, ""],
    // Rules for what the page does not use.
    [/^ {4}"\.cm-(highlightSpace|highlightTab|trailingSpace|placeholder|tooltip-arrow)": \{\n[^]*?\n {4}\},$/gm, ""],
    WORDS_OF_ERRORS,
  ],
  "@codemirror/search": [[COLOURS, ""]],
  "@codemirror/state": [WORDS_OF_ERRORS],
};

/** Cuts the packages while they are bundled. */
export function lean() {
  return {
    name: "lean",
    transform(code, id) {
      const name = Object.keys(CUTS).find((name) => id.includes(`/${name}/dist/`));
      if (!name) return null;
      let text = code;
      for (const [pattern, by] of CUTS[name]) {
        const cut = text.replace(pattern, by);
        if (cut === text) throw new Error(`${name} has no ${pattern} any more`);
        text = cut;
      }
      return { code: text, map: null };
    },
  };
}
