// The shapes, lights and the camera that can be added, from the parser's tables.

import "./scene.css";
import type { JSX } from "preact";

import { nameOf } from "../inspector/words";
import { Icon } from "../parts/icon";
import { Panel } from "../parts/panel";
import { ask, lines, tables } from "../store";
import { visible } from "../parts/visible";
import { iconOf } from "./icons";

export function Palette(): JSX.Element {
  const shown = tables.value.filter((table) => table.role === "object" || table.role === "light" || table.name === "Camera");
  const groups = lines.value.flatMap((line) => (line.role === "group" && line.subject ? [line.subject] : []));
  return (
    <Panel name="palette" title="Add">
      <div class="tiles">
        {shown.map((table) => (
          <button
            type="button"
            key={table.name}
            class={`tile ${table.role}`}
            draggable
            title={
              table.role === "camera"
                ? "The script's camera: click to use the current view, or drag it onto the object that it should look at"
                : `${table.name}: click, or drag it into the picture`
            }
            onDragStart={(event) => event.dataTransfer?.setData("text/plain", table.name)}
            onClick={() => ask({ ask: "add", command: table.name, at: null })}
          >
            <Icon of={iconOf(table.name, table.role)} />
            <span>{table.role === "camera" ? "Camera here" : nameOf(table.name)}</span>
          </button>
        ))}
        {groups.map((name) => (
          <button
            type="button"
            key={`Use ${name}`}
            class="tile use"
            draggable
            title={`The group ${visible(name)}: click, or drag it into the picture`}
            onDragStart={(event) => event.dataTransfer?.setData("text/plain", `Use ${name}`)}
            onClick={() => ask({ ask: "add", command: `Use ${name}`, at: null })}
          >
            <Icon of={iconOf("Use", "use")} />
            <span>{visible(name)}</span>
          </button>
        ))}
      </div>
    </Panel>
  );
}
