// A list of rows of equal height. Only visible rows are rendered, because a script may have a hundred thousand lines.

import { signal } from "@preact/signals";
import type { ComponentChildren, HTMLAttributes, JSX } from "preact";
import { useEffect, useMemo, useRef } from "preact/hooks";

interface Props extends Omit<HTMLAttributes<HTMLDivElement>, "children"> {
  readonly count: number;
  readonly height: number;
  /** The row that must stay visible. */
  readonly reveal: number | null;
  readonly children: (row: number) => ComponentChildren;
}

/** The number of rows rendered beyond the visible ones. */
const BEYOND = 6;

export function List({ count, height, reveal, children, ...rest }: Props): JSX.Element {
  const box = useRef<HTMLDivElement>(null);
  const seen = useMemo(() => signal({ top: 0, height: 600 }), []);
  const kept = useRef<number | null>(null);
  kept.current = reveal;
  const bring = (): void => {
    const [element, row] = [box.current, kept.current];
    if (!element || row === null) return;
    const top = row * height;
    if (top < element.scrollTop) element.scrollTop = top;
    else if (top + height > element.scrollTop + element.clientHeight)
      element.scrollTop = top + height - element.clientHeight;
  };
  useEffect(() => {
    const element = box.current;
    if (!element) return;
    const look = (): void => {
      seen.value = { top: element.scrollTop, height: element.clientHeight };
    };
    // If the list shrinks because another panel grows, its row stays visible.
    const observer = new ResizeObserver(() => {
      bring();
      look();
    });
    observer.observe(element);
    element.addEventListener("scroll", look, { passive: true });
    return () => {
      observer.disconnect();
      element.removeEventListener("scroll", look);
    };
  }, []);
  useEffect(bring, [reveal]);
  const first = Math.max(0, Math.floor(seen.value.top / height) - BEYOND);
  const last = Math.min(count, Math.ceil((seen.value.top + seen.value.height) / height) + BEYOND);
  const rows = [];
  for (let row = first; row < last; row += 1) {
    rows.push(
      <div key={row} class="row" style={{ top: `${row * height}px`, height: `${height}px` }} role="presentation">
        {children(row)}
      </div>,
    );
  }
  return (
    <div ref={box} {...rest}>
      <div class="rows" style={{ height: `${count * height}px` }} role="presentation">
        {rows}
      </div>
    </div>
  );
}
