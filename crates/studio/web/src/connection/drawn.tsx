// A small picture that the studio draws: the program has it at an address.

import type { JSX } from "preact";

import type { Drawing } from "./listener";

export function Drawn(of: Drawing): JSX.Element {
  return <img alt="" {...of} />;
}
