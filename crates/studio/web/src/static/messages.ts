// Messages between the page, the worker of its session, and the workers that draw.

import type { File, Program } from "./module";

/** What a page opens. */
export type Place =
  | { readonly is: "project"; readonly name: string | null }
  /** A zip file at an address of the site. */
  | { readonly is: "example"; readonly name: string; readonly address: string }
  | { readonly is: "files"; readonly name: string; readonly files: readonly File[] }
  | { readonly is: "folder"; readonly handle: FileSystemDirectoryHandle };

/** A frame in its script. */
export interface FramePlace {
  readonly script: string;
  readonly frame: number;
}

/** A frame that was drawn on one thread: the time that this took, and its file. */
export interface Sample extends FramePlace {
  readonly ms: number;
  readonly bytes: number;
  readonly width: number;
  readonly height: number;
}

/** What the page wants to know. */
export type Question =
  | { readonly is: "get"; readonly address: string }
  /** The name of the project, and its files. */
  | { readonly is: "files" }
  | { readonly is: "projects" }
  | { readonly is: "remove"; readonly name: string }
  | { readonly is: "zip" }
  /** The samples of frames, as many as can be drawn in some seconds. */
  | { readonly is: "samples"; readonly frames: readonly FramePlace[] }
  /** The names of files that are left out, as the content of a file without name, and the files of a zip file. */
  | { readonly is: "unzip"; readonly content: Uint8Array }
  /** Whether new scripts are among these files of the project, which are shown once the page is loaded again. */
  | { readonly is: "add"; readonly files: readonly File[] }
  /** The name of a new project of these files. */
  | { readonly is: "import"; readonly name: string; readonly files: readonly File[] }
  /** Whether everything is written. */
  | { readonly is: "write" };

/** To the worker of the session. A text is a message of the page for the session. */
export type ToDesk =
  | string
  | { readonly is: "open"; readonly module: string; readonly place: Place }
  | { readonly is: "ask"; readonly number: number; readonly question: Question };

/** To the page. A text is a message of the session, bytes are a picture. */
export type ToPage =
  | string
  | ArrayBuffer
  | { readonly is: "opened"; readonly project: string; readonly folder: boolean }
  | { readonly is: "closed"; readonly why: string }
  /** A worker is wanted that draws or encodes. It takes its calls from the port. */
  | { readonly is: "helper"; readonly number: number; readonly program: Program; readonly port: MessagePort }
  /** A worker is wanted no longer. */
  | { readonly is: "end"; readonly number: number }
  | { readonly is: "answer"; readonly number: number; readonly value: unknown };

export type Post = (message: ToPage, transfer?: Transferable[]) => void;

/** To a worker that draws, encodes, or draws frames. */
export interface Start {
  readonly is: "start";
  readonly program: Program;
  readonly port: MessagePort;
}

/** A call of such a worker, through its port. */
export interface ToHelper {
  readonly what: number;
  readonly number: number;
  readonly bytes: Uint8Array;
  readonly answers: boolean;
}
