// The page: its panels, and its connection.

import { render } from "preact";

import { listen } from "./actions";
import { Bar, Frames, Keys, Notices, Palette } from "./chrome";
import { FileDialog } from "./file";
import { Inspector } from "./inspector";
import { Outliner } from "./outliner";
import { follow } from "./runs";
import { Runs } from "./runs-panel";
import { Script } from "./script";
import { connect } from "./store";
import "./studio.css";
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
        </div>
        <div class="middle">
          <Viewport />
          <Frames />
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

render(<Studio />, document.body);
listen();
connect();
follow();
