// The page: its panels, and its connection.

import { render } from "preact";

import { listen } from "./actions";
import { Bar, Keys, Notices, Palette } from "./chrome";
import { Inspector } from "./inspector";
import { Materials } from "./materials";
import { Outliner } from "./outliner";
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
    </>
  );
}

render(<Studio />, document.body);
listen();
connect();
