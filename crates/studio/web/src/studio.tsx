// The page: its panels, and its connection.

import { options, render, type ComponentChildren } from "preact";

import { listen } from "./actions";
import { listenClipboard } from "./clipboard";
import "./base.css";
import { Inspector } from "./inspector/inspector";
import { keepFocus } from "./parts/focus";
import { Split } from "./parts/split";
import { Viewport } from "./picture/viewport";
import { Materials } from "./scene/materials";
import { Outliner } from "./scene/outliner";
import { Palette } from "./scene/palette";
import { Scenes } from "./scene/scenes";
import { Script } from "./script/panel";
import { connect, connected, state } from "./store";
import { Timeline } from "./timeline/timeline";
import { Bar, startTheme } from "./top/bar";
import { FileDialog } from "./top/file";
import { Keys } from "./top/keys";
import { Notices } from "./top/notices";
import { Search } from "./top/search";
import { Tour } from "./top/tour";

/** What a page has besides: in the dialog of files, and at its end. */
interface Props {
  readonly places?: ComponentChildren;
  readonly children?: ComponentChildren;
}

function Studio({ places, children }: Props) {
  // Without a studio, nothing can be changed. What was typed can still be selected and copied.
  const isDead = !connected.value;
  return (
    <>
      <Bar />
      <Notices />
      <main>
        <div class="side left" inert={isDead}>
          <Palette />
          <Scenes />
          <Outliner />
          <Materials />
        </div>
        <Split name="left" label="Width of the left panels" first={208} least={140} most={480} />
        <div class="middle" inert={isDead}>
          <Viewport />
          <Timeline />
        </div>
        <Split name="right" label="Width of the right panels" first={340} least={220} most={900} after />
        <div class="side right">
          <Inspector />
          <Split name="script" label="Height of the script" first={360} least={80} most={900} upright after />
          <Script />
        </div>
      </main>
      <Keys />
      <Search />
      {state.value && <Tour />}
      <FileDialog places={places} />
      {children}
    </>
  );
}

/**
 * Renders changes once per frame of the browser: more updates would be invisible and delay the picture. What a key or a
 * click changes is rendered at once, because the next key may be for a field that it opens.
 */
function paceRendering(): void {
  let waiting: (() => void) | undefined;
  let pressed = false;
  const flush = (): void => {
    const update = waiting;
    waiting = undefined;
    if (update) keepFocus(update);
  };
  options.debounceRendering = (update) => {
    waiting = update;
    if (pressed) queueMicrotask(flush);
    else requestAnimationFrame(flush);
  };
  const press = (): void => {
    flush();
    pressed = true;
    setTimeout(() => (pressed = false));
  };
  for (const name of ["keydown", "click"]) addEventListener(name, press, true);
}

/** Shows the page. */
export function start(more: Props): void {
  paceRendering();
  startTheme();
  render(<Studio {...more} />, document.body);
  listen();
  listenClipboard();
  connect();
}
