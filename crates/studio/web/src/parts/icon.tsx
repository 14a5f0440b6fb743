// Icons of the set lucide. Each is a few shapes in a square of 24.

import type { IconNode } from "lucide";
import { h, type JSX } from "preact";

export function Icon({ of }: { readonly of: IconNode }): JSX.Element {
  return (
    <svg class="icon" viewBox="0 0 24 24" aria-hidden="true">
      {of.map(([shape, attributes]) => h(shape, attributes as Record<string, string>))}
    </svg>
  );
}
