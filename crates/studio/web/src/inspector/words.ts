// Parameters in people's words. One that is not here has the name of the language.

import type { FieldTable } from "../protocol";

const WORDS: Readonly<Record<string, string>> = {
  "ambient coefficient": "shadow colour",
  "diffuse coefficient": "colour",
  "mirror coefficient": "mirror",
  "glass coefficient": "clearness",
  "light's colour": "light",
  "light's direction": "direction",
  "lamp's position": "position",
  "lamp's radius": "size of the lamp",
  "lamp's reach": "reach",
  "sun's angle": "softness",
  "shine": "highlight",
  "exponent n": "polish",
  "index of refraction": "refraction",
  "size s": "pattern size",
  "start a": "from",
  "end b": "to",
  "axis's end ax": "start",
  "axis's end": "end",
  "background R": "above",
  "corner vx": "other corner",
  "vertex vx": "second vertex",
  "vertex wx": "third vertex",
  "radius Ra": "radius at the start",
  "radius Rb": "radius at the end",
  "thickness r": "thickness",
  "view-up": "up",
  "size of the letters": "size",
  "depth of the letters": "depth",
  "window's distance s": "window distance",
  "window's corner": "window corner",
  "window's corner bu": "other corner",
  "number of samples": "samples",
  "error e": "allowed noise",
  "lens's radius": "blur",
  "lens's distance": "focus distance",
  "width nx": "width",
  "height ny": "height",
  "first frame a": "first frame",
  "last frame b": "last frame",
};

/** What a parameter does, for its tooltip, where its name does not say it. */
const MEANINGS: Readonly<Record<string, string>> = {
  "ambient coefficient": "The colour without any light",
  "diffuse coefficient": "The share of light that it scatters",
  "mirror coefficient": "The share of its surroundings that it reflects",
  "sun's angle": "The angle of the sun in degrees: shadows get softer with it",
  "exponent n": "Larger numbers make highlights smaller, as on polished surfaces",
};

/** The word of a parameter. The name of its first number tells those of a line apart that have the same label. */
export function wordOf({ label, names }: FieldTable): string {
  return WORDS[`${label} ${names[0]}`] ?? WORDS[label] ?? label;
}

export function meaningOf(label: string): string {
  return MEANINGS[label] ?? label;
}

/** Short names of a number among those of a parameter: `x` for `cx`, `u` for `au`, `red` for `rr`. */
export function shortOf(name: string, kind: string): string {
  const last = name.at(-1) ?? "";
  if (kind === "colour" || kind === "coefficients") return { r: "red", g: "green", b: "blue" }[last] ?? name;
  return "xyzuv".includes(last) && name.length <= 3 ? last : name;
}

/** Commands and clauses in people's words. */
const NAMES: Readonly<Record<string, string>> = {
  Ilight: "Sun",
  Plight: "Lamp",
  Screen: "Picture",
  Samples: "Smooth edges",
  Depth: "Bounces",
  Shutter: "Motion blur",
  Camera: "through a window",
  Look: "looks at a target",
  Orthocamera: "parallel",
  ambient: "shadow colour",
  diffuse: "colour",
  shine: "highlight",
  own: "own colours",
  'Sky "FILE"': "Sky picture",
  Roundbox: "Rounded box",
};

export function nameOf(command: string): string {
  return NAMES[command] ?? command;
}

const UNITS: Readonly<Record<string, string>> = { degrees: "°", pixels: "px" };

export function unitOf(unit: string): string {
  return UNITS[unit] ?? "";
}
