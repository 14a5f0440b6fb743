// The bar at the top: the project, undo and redo, the view, and the output.

import "./top.css";
import { ChevronDown, Download, FolderOpen, House, SunMoon } from "lucide";
import type { JSX } from "preact";

import { startPage } from "#connection";

import { actions } from "../actions";
import { Button } from "../parts/button";
import { Icon } from "../parts/icon";
import { remember, remembered } from "../parts/memory";
import { visible } from "../parts/visible";
import type { MovieFormat } from "../protocol";
import { ask, canSubmit, connected, files, output, state } from "../store";
import { filing } from "./file";

const FORMATS: Readonly<Record<MovieFormat, string>> = { gif: "GIF", apng: "APNG", webp: "WebP" };

const SAVED = { yes: "saved", soon: "saving", conflict: "not saved", failed: "cannot be saved" } as const;

export function Bar(): JSX.Element {
  const now = state.value;
  const file = now ? files.value[now.file] : undefined;
  const saved = connected.value ? (now?.saved ?? "yes") : "failed";
  const title = visible(now?.title ?? "rayfold studio");
  const name = visible(file?.name ?? "");
  return (
    <header class="bar">
      <div class="project">
        <h1>{title}</h1>
        {name !== title && <span class="file">{name}</span>}
        <span class={`saved ${saved}`} role="status">
          {!now ? "" : connected.value ? SAVED[now.saved] : "not connected"}
        </span>
      </div>
      <nav aria-label="Edit" class="group">
        {startPage && (
          <a class="button icon-button" href={startPage} title="The start page: examples. What is open is kept" aria-label="Start page">
            <Icon of={House} />
          </a>
        )}
        <button type="button" class="icon-button" title="Open an example or a file, save under another name" aria-label="File" onClick={() => (filing.value = true)}>
          <Icon of={FolderOpen} />
        </button>
        <Button action={actions.undo} label="Undo" />
        <Button action={actions.redo} label="Redo" />
      </nav>
      <nav aria-label="View" class="group">
        <Button action={actions.script} label="Camera" pressed={now ? !now.free : undefined} />
        <Button action={actions.lookFront} label="Front" />
        <Button action={actions.lookSide} label="Side" />
        <Button action={actions.lookTop} label="Top" />
        <Button action={actions.frame} label="Selection" />
        <Button action={actions.keepCamera} label="Keep this view" />
        {typeof now?.draft === "boolean" && <Button action={actions.draft} label="Draft" pressed={now.draft} />}
      </nav>
      <span class="gap" />
      <Result />
      <div class="group">
        <button type="button" class="icon-button" title="Light or dark" aria-label="Light or dark" onClick={switchTheme}>
          <Icon of={SunMoon} />
        </button>
        <Button action={actions.search} label="Search" />
        <Button action={actions.help} label="Keys" />
      </div>
    </header>
  );
}

const root = document.documentElement;

/** Takes the colours that were chosen before, else those of the system. */
export function startTheme(): void {
  root.style.colorScheme = remembered("theme", "");
}

function switchTheme(): void {
  const chosen = root.style.colorScheme;
  const isDark = chosen === "dark" || (chosen === "" && matchMedia("(prefers-color-scheme: dark)").matches);
  root.style.colorScheme = isDark ? "light" : "dark";
  remember("theme", root.style.colorScheme);
}

function Result(): JSX.Element {
  const now = output.value;
  const frame = state.value?.frame ?? 0;
  const close = (event: MouseEvent): void => (event.currentTarget as HTMLElement).closest<HTMLElement>("[popover]")?.hidePopover();
  return (
    <div class="result" role="group" aria-label="Output">
      {now?.is === "done" && (
        <a class="button" href="animation" download={`${state.value?.title.replace(/\.txt$/, "") ?? "animation"}.${now.format}`}>
          <Icon of={Download} />
          Download {FORMATS[now.format]} ({Math.max(1, Math.round(now.bytes / 1000))} kB)
        </a>
      )}
      {now?.is === "failed" && <span class="failed">{visible(now.why)}</span>}
      {now?.is === "cancelled" && <span>cancelled</span>}
      {now?.is === "running" ? (
        <>
          <progress value={now.done} max={now.of} aria-label="Frames drawn" /> {now.done} of {now.of}
          <button type="button" onClick={() => ask({ ask: "cancel" })}>
            Cancel
          </button>
        </>
      ) : (
        <button type="button" class="main" onClick={() => ask({ ask: "render", format: "gif" })}>
          Render GIF
        </button>
      )}
      <button type="button" class="main more" aria-label="More output" title="More output" popovertarget="more-output">
        <Icon of={ChevronDown} />
      </button>
      <div id="more-output" class="menu" popover="auto">
        {(["apng", "webp"] as const).map((format) => (
          <button
            key={format}
            type="button"
            disabled={now?.is === "running"}
            title={`The animation without loss, as ${FORMATS[format]}`}
            onClick={(event) => (ask({ ask: "render", format }), close(event))}
          >
            Render {FORMATS[format]}
          </button>
        ))}
        <a href={`frame.png?${frame}`} download={`frame${frame + 1}.png`} onClick={close} title="The shown frame, as PNG">
          Frame
        </a>
        <a href="frames.zip" download="frames.zip" onClick={close} title="All frames, as PNG in a zip file">
          Frames
        </a>
        <a href="scripts.zip" download="scripts.zip" onClick={close} title="The scripts as they are on the page">
          Scripts
        </a>
        {canSubmit.value && (
          <>
            <a href="#submit" onClick={close} title="Render it in the bucket">
              Submit
            </a>
            <a href="#runs" onClick={close} title="The runs of the bucket">
              Runs
            </a>
          </>
        )}
      </div>
    </div>
  );
}
