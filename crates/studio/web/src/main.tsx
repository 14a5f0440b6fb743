// The page: its panels, and its connection.

import { options, render } from "preact";

import { listen } from "./actions";
import { Bar, Keys, Notices, Palette } from "./chrome";
import { FileDialog } from "./file";
import { Inspector } from "./inspector";
import { Materials } from "./materials";
import { Outliner } from "./outliner";
import { follow } from "./runs";
import { Runs } from "./runs-panel";
import { Script } from "./script";
import { connect } from "./store";
import "./studio.css";
import { Timeline } from "./timeline";
import { Viewport } from "./viewport";

function Studio() {
  return (
    <>
      <Bar />
      <Notices />
      <main>
        <div class="side">
          <Palette />
          <Outliner />
          <Materials />
        </div>
        <div class="middle">
          <Viewport />
          <Timeline />
        </div>
        <div class="side">
          <Inspector />
          <Script />
        </div>
      </main>
      <Keys />
      <FileDialog />
      <Runs />
    </>
  );
}

// Once per frame of the browser: more updates would be invisible and delay the picture.
options.debounceRendering = (update) => requestAnimationFrame(update);
render(<Studio />, document.body);
listen();
connect();
follow();
