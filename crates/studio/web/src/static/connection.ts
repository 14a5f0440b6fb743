// The connection to the session in a worker of the page.

import { signal } from "@preact/signals";

import type { Listener, Send } from "../connection/listener";
import { addressOf, NEW, place, opened as remember } from "./address";
import { FOLDER } from "./disk";
import type { FramePlace, Question, Sample, Start, ToDesk, ToPage } from "./messages";
import type { File } from "./module";
import { moduleFile } from "./variant";

/** The name of the open project. */
export const project = signal("");

let worker: Worker | null = null;
let questions = 0;
const waiting = new Map<number, (value: unknown) => void>();

function post(message: ToDesk, transfer: Transferable[] = []): void {
  worker?.postMessage(message, transfer);
}

function ask(question: Question): Promise<unknown> {
  questions += 1;
  const number = questions;
  return new Promise((done) => {
    waiting.set(number, done);
    post({ is: "ask", number, question });
  });
}

/** Returns a file of the studio by its address, as the program serves it; nothing if there is none. */
export async function get(address: string): Promise<Uint8Array<ArrayBuffer> | null> {
  const content = (await ask({ is: "get", address })) as Uint8Array<ArrayBuffer> | null;
  return content && content.length > 0 ? content : null;
}

export const ownFiles = async (): Promise<readonly File[]> => ((await ask({ is: "files" })) as readonly File[] | null) ?? [];
export const projects = async (): Promise<readonly string[]> => ((await ask({ is: "projects" })) as readonly string[] | null) ?? [];
export const removeProject = (name: string): Promise<unknown> => ask({ is: "remove", name });
export const zip = async (): Promise<Uint8Array<ArrayBuffer> | null> => (await ask({ is: "zip" })) as Uint8Array<ArrayBuffer> | null;
export const unzip = async (content: Uint8Array): Promise<readonly File[] | null> => (await ask({ is: "unzip", content })) as readonly File[] | null;
/** Draws frames on one thread: as many of them as some seconds allow, and none if the first takes longer. Nothing if one cannot be drawn. */
export const samples = async (frames: readonly FramePlace[]): Promise<readonly Sample[] | null> => (await ask({ is: "samples", frames })) as readonly Sample[] | null;
/** Puts files into the project. Returns whether the page has to be loaded again to show them. */
export const addFiles = async (files: readonly File[]): Promise<boolean> => (await ask({ is: "add", files })) === true;
/** Keeps files as a new project, and returns its name. */
export const importProject = async (name: string, files: readonly File[]): Promise<string | null> =>
  (await ask({ is: "import", name, files })) as string | null;
/** Waits until the files are written. */
export const write = (): Promise<unknown> => ask({ is: "write" });

/** Leaves what is open for a new project, also if the studio has stopped. */
export const openNew: (() => void) | null = () => {
  location.hash = NEW;
  location.reload();
};

/** The address of the start page. */
export const startPage: string | null = "index.html";

const newWorker = (): Worker => new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });

export function open({ opened, told, shown, closed }: Listener): Send {
  let isOpen = true;
  const own = newWorker();
  const helpers = new Map<number, Worker>();
  worker = own;
  const end = (why: string): void => {
    isOpen = false;
    if (why) told(JSON.stringify({ notice: `The studio has stopped: ${why}` }));
    closed();
  };
  own.onerror = (event) => end(event.message);
  own.onmessage = ({ data }: MessageEvent<ToPage>) => {
    if (typeof data === "string") told(data);
    else if (data instanceof ArrayBuffer) shown(data);
    else if (data.is === "answer") {
      waiting.get(data.number)?.(data.value);
      waiting.delete(data.number);
    } else if (data.is === "helper") {
      const helper = newWorker();
      helper.onerror = own.onerror;
      helper.postMessage({ is: "start", program: data.program, port: data.port } satisfies Start, [data.port]);
      helpers.set(data.number, helper);
    } else if (data.is === "end") {
      helpers.get(data.number)?.terminate();
      helpers.delete(data.number);
    } else if (data.is === "closed") end(data.why);
    else {
      project.value = data.project;
      remember(data.folder ? FOLDER : addressOf(data.project));
      opened();
    }
  };
  const module = new URL(moduleFile, location.href).href;
  place().then(
    (place) => post({ is: "open", module, place }),
    (error: unknown) => end(error instanceof Error ? error.message : String(error)),
  );
  // Not all is written yet when the page goes.
  addEventListener("pagehide", () => void write());
  return (text) => {
    if (isOpen) post(text);
    return isOpen;
  };
}
