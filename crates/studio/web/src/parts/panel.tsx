// A panel with a title, by which it is collapsed. The page remembers which are.

import { signal } from "@preact/signals";
import type { ComponentChildren, JSX } from "preact";
import { useMemo } from "preact/hooks";

import { Icon } from "./icon";
import { ChevronDown, ChevronRight } from "lucide";
import { remember, remembered } from "./memory";

interface Props {
  readonly name: string;
  readonly title: string;
  readonly children: ComponentChildren;
}

export function Panel({ name, title, children }: Props): JSX.Element {
  const open = useMemo(() => signal(remembered(name, "open") === "open"), []);
  const toggle = (): void => {
    open.value = !open.value;
    remember(name, open.value ? "open" : "closed");
  };
  return (
    <section class={open.value ? `panel ${name}` : `panel ${name} closed`} aria-labelledby={`${name}-title`}>
      <h2>
        <button type="button" id={`${name}-title`} class="fold" aria-expanded={open.value} onClick={toggle}>
          <Icon of={open.value ? ChevronDown : ChevronRight} />
          {title}
        </button>
      </h2>
      <div class="content" hidden={!open.value}>
        {children}
      </div>
    </section>
  );
}
