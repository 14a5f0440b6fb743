// A tour of five steps beside the parts of the page that they are about. Escape or a button leaves it at once.

import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect } from "preact/hooks";

/** The shown step; `null` without a tour. */
export const tour = signal<number | null>(location.hash === "#tour" ? 0 : null);

const STEPS = [
  [".palette", "Drag a shape into the picture, or click one."],
  [".viewport", "Drag objects by their bodies, and the background to turn the view. All that you see is the final picture."],
  [".inspector", "Numbers, colours and the scene's settings are here. Every change is written into the script below."],
  [".timeline", "Animate: go to a later frame and drag an object there. It moves between its keys."],
  [".result", "Render the GIF, or download frames and scripts."],
] as const;

const WIDTH = 280;

export function Tour(): JSX.Element | null {
  const at = tour.value;
  const end = (): void => void (tour.value = null);
  useEffect(() => {
    // The focus may be elsewhere: a dialog that closes gives it back to what had it before.
    const leave = (event: KeyboardEvent): void => {
      if (event.key !== "Escape" || tour.value === null || document.querySelector("dialog[open]")) return;
      event.stopPropagation();
      end();
    };
    addEventListener("keydown", leave, true);
    return () => removeEventListener("keydown", leave, true);
  }, []);
  const [part, text] = STEPS[at ?? -1] ?? [];
  const box = part && document.querySelector(part)?.getBoundingClientRect();
  if (at === null || !box) return null;
  // Beside a narrow part, and above one that is below the middle.
  const beside = box.left > WIDTH ? box.left - WIDTH - 8 : box.right + 8;
  const left = Math.max(8, Math.min(innerWidth - WIDTH - 8, box.width < WIDTH * 2 ? beside : box.left + (box.width - WIDTH) / 2));
  const top = Math.max(8, Math.min(innerHeight - 150, box.top + (box.top > innerHeight / 2 ? -130 : Math.min(box.height, 120) / 2)));
  return (
    <div
      key={at}
      class="tour"
      role="dialog"
      aria-label="Tour"
      style={{ left: `${left}px`, top: `${top}px`, width: `${WIDTH}px` }}
      onKeyDown={(event) => event.stopPropagation()}
    >
      <p>{text}</p>
      <button type="button" onClick={end}>
        Leave
      </button>
      <span class="note">
        {at + 1} of {STEPS.length}
      </span>
      <button type="button" class="main" ref={(button) => button?.focus()} onClick={() => (tour.value = at + 1 < STEPS.length ? at + 1 : null)}>
        {at + 1 < STEPS.length ? "Next" : "Done"}
      </button>
    </div>
  );
}
