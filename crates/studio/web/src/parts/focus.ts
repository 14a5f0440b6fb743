// The focus stays where it was when a panel is drawn anew: what has it may be another element afterwards, or be gone.

const FIELDS = "button, input, select, textarea, a[href], [tabindex='0']";

const all = (of: Element): readonly HTMLElement[] => [...of.querySelectorAll<HTMLElement>(FIELDS)];

const nameOf = (of: Element): string => of.ariaLabel ?? of.textContent ?? "";

/** Runs what changes the page. If that removes what has the focus, its successor gets it, else what was before it. */
export function keepFocus(update: () => void): void {
  const had = document.activeElement;
  const panel = had?.closest(".panel");
  if (!had || !panel) return update();
  const before = all(panel);
  update();
  if (had.isConnected || document.activeElement !== document.body) return;
  const now = panel.isConnected ? all(panel) : [];
  const twin = now.find((other) => other.tagName === had.tagName && nameOf(other) === nameOf(had));
  const earlier = before.slice(0, before.indexOf(had as HTMLElement)).findLast((other) => other.isConnected);
  const next = [twin, earlier, ...now].find((other) => other?.checkVisibility() && !other.matches(":disabled"));
  (next ?? document.querySelector<HTMLElement>(".viewport"))?.focus({ preventScroll: true });
}
