// Runs in a bucket: submitting the animation after an estimate of its cost, the list of runs, and one run with its
// frames, its errors and its GIF.

import "./runs.css";
import { signal } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";

import { Drawn } from "#drawn";

import { List } from "../parts/list";
import { visible } from "../parts/visible";
import {
  address,
  fetchOffer,
  go,
  list,
  offer,
  ownName,
  picture,
  refusal,
  resource,
  retry,
  run,
  submit,
  view,
  waiting,
  type Offer,
  type Refusal,
  type Run,
} from "./runs";
import type { FaultInfo, FrameUpdate, RunFile, Summary } from "../protocol";
import { openPlace } from "../script/panel";
import { files, notice } from "../store";

/** Width and height of a frame in the grid, in pixels of the window. */
const CELL = [168, 132] as const;

/** The part of the window's width that the dialog does not use, including its borders. */
const EDGES = 60;

const name = signal<string | null>(null);
const mayDelete = signal(false);
const columns = signal(4);

export function Runs(): JSX.Element | null {
  const dialog = useRef<HTMLDialogElement>(null);
  const what = view.value.what;
  useEffect(() => {
    const measure = (): void => {
      columns.value = Math.max(1, Math.floor((Math.min(1120, innerWidth) - EDGES) / CELL[0]));
    };
    measure();
    addEventListener("resize", measure);
    return () => removeEventListener("resize", measure);
  }, []);
  useEffect(() => {
    if (what !== "closed" && dialog.current && !dialog.current.open) dialog.current.showModal();
  }, [what]);
  if (what === "closed") return null;
  return (
    <dialog class="runs" ref={dialog} aria-labelledby="runs-title" onClose={() => go({ what: "closed" })}>
      <nav aria-label="Runs" class="tabs">
        <a class="button" href={address({ what: "submit" })} aria-current={what === "submit" ? "page" : undefined}>
          Submit
        </a>
        <a class="button" href={address({ what: "list" })} aria-current={what === "list" ? "page" : undefined}>
          All runs
        </a>
        <span class="gap" />
        <button type="button" onClick={() => dialog.current?.close()}>
          Back to the scene
        </button>
      </nav>
      {what === "submit" && <Submit />}
      {what === "list" && <All />}
      {view.value.what === "run" && <One name={view.value.run} />}
      {refusal.value && <Refused refusal={refusal.value} />}
      {notice.value && <p role="status">{visible(notice.value)}</p>}
    </dialog>
  );
}

function NoBucket(): JSX.Element {
  return (
    <p>
      No bucket was named: end the studio and start it with <code>--bucket NAME</code>, in the environment that{" "}
      <code>rayfold submit</code> takes. <code>rayfold dev</code> gives you a bucket on this machine.
    </p>
  );
}

function Submit(): JSX.Element {
  const known = list.value;
  const now = offer.value;
  const chosen = name.value ?? ownName.value;
  const gone = now?.delete ?? [];
  return (
    <>
      <h2 id="runs-title">Submit to a bucket{known?.bucket ? `: ${known.bucket}` : ""}</h2>
      {known && known.bucket === null ? (
        <NoBucket />
      ) : (
        <form
          class="submit"
          onSubmit={(event) => {
            event.preventDefault();
            if (now) void submit(chosen, mayDelete.value ? gone : []);
            else {
              mayDelete.value = false;
              void fetchOffer(chosen);
            }
          }}
        >
          <p>
            <label>
              Name of the run{" "}
              <input
                class="rename"
                value={chosen}
                onInput={(event) => {
                  name.value = event.currentTarget.value;
                  offer.value = null;
                }}
              />
            </label>
          </p>
          {now && <Cost offer={now} />}
          {gone.length > 0 && (
            <p>
              <label>
                <input type="checkbox" checked={mayDelete.value} onInput={(event) => (mayDelete.value = event.currentTarget.checked)} /> Delete{" "}
                {gone.length === 1 ? "a script" : `${gone.length} scripts`} of the bucket that the page does not have: {gone.slice(0, 20).join(", ")}
              </label>
            </p>
          )}
          <p>
            <button class="main" disabled={waiting.value || (gone.length > 0 && !mayDelete.value)}>
              {waiting.value ? "Please wait" : now ? "Submit" : "Estimate the cost"}
            </button>
          </p>
        </form>
      )}
    </>
  );
}

function dollars(usd: number): string {
  return usd < 0.00005 ? "less than 0.0001" : usd.toFixed(4);
}

function Cost({ offer: { estimate, frames, folder, upload, unchanged } }: { readonly offer: Offer }): JSX.Element {
  const count = estimate?.frames ?? frames;
  return (
    <>
      <p>
        {count} {count === 1 ? "frame" : "frames"}
        {estimate && ` of ${estimate.size.join(" × ")} pixels, ${estimate.drawingMs.toFixed(1)} ms each on one thread of this machine`}. To {folder}: {upload} {upload === 1 ? "file" : "files"} to upload, {unchanged} there already.
      </p>
      {estimate && <Bill estimate={estimate} />}
    </>
  );
}

function Bill({ estimate }: { readonly estimate: NonNullable<Offer["estimate"]> }): JSX.Element {
  return (
    <table class="cost">
      <caption>Cost on AWS, in US dollars ({estimate.prices}; free allowances left out). On this machine it costs nothing.</caption>
      <thead>
        <tr>
          <th scope="col">For</th>
          <th scope="col">US dollars</th>
        </tr>
      </thead>
      <tbody>
        {estimate.sections.map((section) => (
          <tr key={section.title}>
            <th scope="row">
              <details>
                <summary>{section.title}</summary>
                <ul>
                  {section.lines.map((line) => (
                    <li key={line.item}>
                      {line.item}: {Number(line.amount.toPrecision(4))}
                      {line.unit && ` ${line.unit}`}, {dollars(line.usd)}
                    </li>
                  ))}
                </ul>
              </details>
            </th>
            <td>{dollars(section.usd)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

function Refused({ refusal: { why, script, place } }: { readonly refusal: Refusal }): JSX.Element {
  return (
    <p class="failed" role="alert">
      {why} {place && <Place script={script} place={place} />}
    </p>
  );
}

/** A button that opens a line of a script, if the script is open here. */
function Place({ script, place: [line, column] }: { readonly script: string | undefined; readonly place: readonly [number, number] }): JSX.Element | null {
  const file = files.value.findIndex((file) => file.name.replace(/\.txt$/, "") === script);
  if (file < 0) {
    return (
      <span>
        {script}.txt, line {line}, column {column}
      </span>
    );
  }
  return (
    <button
      type="button"
      onClick={() => {
        go({ what: "closed" });
        openPlace(file, line - 1, column - 1);
      }}
    >
      Open {files.value[file]?.name}, line {line}, column {column}
    </button>
  );
}

function stand({ status, done, failed, total, behind }: Summary): string {
  const frames = `${done} of ${total} ${total === 1 ? "frame" : "frames"}`;
  const words = status === "new" ? "no function has looked at it yet" : status === "unreadable" ? "its manifest cannot be read" : frames;
  return `${status}: ${words}${failed > 0 ? `, ${failed} failed` : ""}${behind ? "; newer scripts wait to be seen" : ""}`;
}

function All(): JSX.Element {
  const known = list.value;
  return (
    <>
      <h2 id="runs-title">Runs{known?.bucket ? ` in ${known.bucket}` : ""}</h2>
      {known && known.bucket === null && <NoBucket />}
      {!known && waiting.value && <p>Loading</p>}
      {known && known.bucket !== null && known.runs.length === 0 && <p>There are no runs yet.</p>}
      <ul class="all">
        {known?.runs.map((summary) => (
          <li key={summary.run}>
            <a href={address({ what: "run", run: summary.run })}>{summary.run}</a> <span>{stand(summary)}</span>{" "}
            {summary.files.map((file) => (
              <span key={file.ending}>
                {file.current ? "" : "last "}
                {file.format} of {size(file.bytes)}{" "}
              </span>
            ))}
          </li>
        ))}
      </ul>
      {known && known.more > 0 && <p>and {known.more} more, which `rayfold status` lists</p>}
    </>
  );
}

function size(bytes: number): string {
  return bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1000))} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}

function One({ name }: { readonly name: string }): JSX.Element {
  const now = run.value;
  return (
    <>
      <h2 id="runs-title">{name}</h2>
      {!now && <p>Loading</p>}
      {now && <Standing run={now} />}
      {now && (now.faults.length > 0 || now.failed > 0) && <Faults run={now} />}
      {now?.files[0] && <Result run={now} first={now.files[0]} />}
      {now && now.frames.length > 0 && <Grid run={now} />}
    </>
  );
}

function Standing({ run: now }: { readonly run: Run }): JSX.Element {
  const { sending } = now;
  return (
    <div class="standing">
      <p role="status" data-status={now.status} data-settled={now.settled}>
        {sending?.is === "uploading" ? `uploading: ${sending.done} of ${sending.total} scripts` : stand(now)}
      </p>
      {sending?.is === "failed" && <p class="failed">The upload failed: {sending.why}</p>}
      {now.problem && <p class="failed">No newer state is known: {now.problem}</p>}
      {now.total > 0 && <progress value={now.done} max={now.total} aria-label="Frames drawn" />}
    </div>
  );
}

function Result({ run: now, first }: { readonly run: Run; readonly first: RunFile }): JSX.Element {
  const name = `${now.run.split("/").at(-1) ?? "animation"}`;
  // A browser shows no raw video.
  const shown = now.files.find((file) => file.ending !== "y4m");
  const source = (file: RunFile): string =>
    resource("file", { run: now.run, output: file.ending, version: file.version });
  return (
    <figure class="gif">
      {shown && <Drawn src={source(shown)} alt={`The animation ${now.run}`} />}
      <figcaption>
        {first.current ? `The finished ${first.format}` : `The previous ${first.format}; a newer one is being made`}
        <span class="buttons">
          {now.files.map((file) => (
            <a key={file.ending} class="button" href={source(file)} download={`${name}.${file.ending}`}>
              Download {file.format} ({size(file.bytes)})
            </a>
          ))}
          <a class="button" href={resource("frames.zip", { run: now.run })} download={`${name}-frames.zip`}>
            Download frames
          </a>
        </span>
      </figcaption>
    </figure>
  );
}

function Faults({ run: now }: { readonly run: Run }): JSX.Element {
  return (
    <section aria-labelledby="faults-title">
      <h3 id="faults-title">Errors</h3>
      <ul class="run-faults">
        {now.faults.map((fault, at) => (
          <FaultRow key={`${at}:${fault.what}`} run={now.run} fault={fault} />
        ))}
      </ul>
      {now.moreFaults > 0 && <p>and {now.moreFaults} more</p>}
      <p>
        <button type="button" disabled={waiting.value} onClick={() => void retry(now.run)}>
          Retry all that failed
        </button>{" "}
        A script with an error fails again: fix it and submit again. Only changed scripts are rendered.
      </p>
    </section>
  );
}

function FaultRow({ run, fault }: { readonly run: string; readonly fault: FaultInfo }): JSX.Element {
  return (
    <li>
      <b>{fault.what}</b>
      {fault.place ? `, line ${fault.place[0]}, column ${fault.place[1]}` : ""}: {fault.message}. {fault.help && <i>{fault.help}</i>}{" "}
      <span class="buttons">
        {fault.place && <Place script={fault.script} place={fault.place} />}
        {fault.script !== undefined && (
          <button type="button" disabled={waiting.value} onClick={() => void retry(run, fault)}>
            Retry this frame
          </button>
        )}
      </span>
    </li>
  );
}

function Grid({ run: now }: { readonly run: Run }): JSX.Element {
  const across = columns.value;
  return (
    <section aria-labelledby="frames-title">
      <h3 id="frames-title">Frames</h3>
      <List
        class="list cells"
        count={Math.ceil(now.frames.length / across)}
        height={CELL[1]}
        reveal={null}
        role="group"
        aria-label="Frames"
        tabIndex={0}
      >
        {(row) =>
          now.frames
            .slice(row * across, (row + 1) * across)
            .map((frame, at) => <Cell key={row * across + at} run={now.run} number={row * across + at + 1} frame={frame} />)
        }
      </List>
    </section>
  );
}

function Cell({ run, number, frame }: { readonly run: string; readonly number: number; readonly frame: FrameUpdate }): JSX.Element {
  const title = frame.part === undefined ? frame.script : `${frame.script}, ${frame.part}`;
  return (
    <div class={`cell ${frame.state}`} data-frame={number} data-state={frame.state}>
      {frame.state === "done" ? (
        <a href={picture(run, frame)} download={`frame${number}.png`} title={`Download frame ${number}`}>
          <Drawn src={picture(run, frame)} alt={`Frame ${number}`} loading="lazy" />
        </a>
      ) : (
        <span class="no-picture">{frame.state === "failed" ? "failed" : "awaited"}</span>
      )}
      <span class="caption">
        {number}: {title}
      </span>
    </div>
  );
}
