// The messages between page and server: the types of `protocol.rs`. Points are in pixels of the picture. Lines count
// from 0.

export type Role = "object" | "light" | "use" | "group" | "material" | "camera" | "setting";

export interface Field {
  readonly label: string;
  readonly names: readonly string[];
  readonly kind: string;
  readonly unit: string;
  readonly values: string;
  readonly optional: boolean;
  readonly first: number;
}

export interface Command {
  readonly name: string;
  readonly role: Role;
  readonly fields: readonly Field[];
}

export interface FileState {
  readonly name: string;
  readonly frames: number;
  readonly faulty: boolean;
}

export interface Line {
  readonly text: string;
  readonly command?: string;
  readonly role?: Role;
  readonly name?: string;
  /** The name of a group or material before the numbers. */
  readonly subject?: string;
  readonly hidden?: boolean;
}

export type Grip =
  | { readonly what: "body" }
  | { readonly what: "axis" | "plane"; readonly axis: number }
  | { readonly what: "point" | "length" | "direction" | "scale"; readonly first: number }
  | { readonly what: "turn"; readonly first: number; readonly axis: number };

export type Point = readonly [number, number];

export interface Handle {
  readonly grip: Grip;
  readonly line: number;
  readonly label: string;
  readonly at: Point;
  readonly from: Point;
  /** The path along which it moves, as an SVG path. */
  readonly way?: string;
}

export interface Fault {
  readonly line: number;
  readonly column: number;
  readonly length: number;
  readonly error: boolean;
  readonly message: string;
  readonly help: string;
}

export interface Inspected {
  readonly line: number;
  readonly command: string;
  readonly values: readonly (number | null)[];
  /** The numbers that are curves, and those of them with a key at the shown frame. */
  readonly curves: readonly number[];
  readonly keyed: readonly number[];
  readonly canKey: boolean;
  /** The name of a material in place of coefficients. */
  readonly material: string | null;
  readonly subject: string;
  /** The parameters of a material, which depend on its clauses. */
  readonly fields: readonly Field[];
}

export interface TimeState {
  /** The number of the shown frame, and the first and the last frame number of its `Trace`. */
  readonly number: number;
  readonly first: number;
  readonly last: number;
  /** The index of the first number among all frames, from 0. */
  readonly start: number;
  readonly autoKey: boolean;
  readonly path: boolean;
  readonly onion: boolean;
  readonly copied: number;
}

export type Mode = "linear" | "smooth" | "step";

/** A number that changes. Its keys are frames and values. */
export interface Track {
  readonly line: number;
  readonly number: number;
  readonly label: string;
  readonly mode: Mode;
  readonly cycle: boolean;
  readonly keys: readonly (readonly [number, number])[];
}

export interface Tracks {
  readonly tracks: readonly Track[];
  readonly more: boolean;
}

export interface KeyPlace {
  readonly line: number;
  readonly number: number;
  readonly frame: number;
}

export interface Ghost {
  readonly path: string;
  readonly after: number;
}

export type TimeWish =
  | { readonly do: "switch"; readonly what: "auto-key" | "path" | "onion"; readonly on: boolean }
  | { readonly do: "key"; readonly lines: readonly number[] }
  | { readonly do: "toggle"; readonly line: number; readonly numbers: readonly number[] }
  | { readonly do: "grab" | "remove" | "copy"; readonly keys: readonly KeyPlace[] }
  | { readonly do: "move"; readonly by: number }
  | { readonly do: "paste" }
  | { readonly do: "ease"; readonly keys: readonly KeyPlace[]; readonly mode: Mode; readonly cycle: boolean }
  | { readonly do: "pace"; readonly fps: number }
  | { readonly do: "frames"; readonly count: number };

export interface State {
  /** The number of messages that the server had received. */
  readonly asked: number;
  readonly title: string;
  readonly fps: number;
  readonly frame: number;
  readonly frames: number;
  readonly file: number;
  readonly saved: "yes" | "soon" | "conflict" | "failed";
  /** The reason why the file cannot be written. */
  readonly failure: string;
  readonly canUndo: boolean;
  readonly canRedo: boolean;
  readonly selection: readonly number[];
  readonly inspected: Inspected | null;
  readonly faults: readonly Fault[];
  readonly handles: readonly Handle[];
  readonly grid: string;
  /** The motion path of the selection, and its keys. */
  readonly way: string;
  readonly marks: string;
  /** The lines that cannot be dragged in the picture. */
  readonly locked: readonly number[];
  readonly time: TimeState;
  readonly free: boolean;
  /** Number, width and height of the picture that was requested last. */
  readonly picture: readonly [number, number, number] | null;
}

export type Output =
  | { readonly is: "running"; readonly done: number; readonly of: number }
  | { readonly is: "done"; readonly bytes: number }
  | { readonly is: "cancelled" }
  | { readonly is: "failed"; readonly why: string };

export type Source =
  | { readonly what: "empty" | "shown" }
  | { readonly what: "example"; readonly name: string }
  | { readonly what: "text"; readonly text: string };

/** A message of the server. Omitted fields have not changed. */
export interface Tell {
  readonly examples?: readonly string[];
  readonly canCreate?: boolean;
  readonly tables?: readonly Command[];
  readonly presets?: readonly string[];
  readonly files?: readonly FileState[];
  readonly lines?: readonly Line[];
  readonly splices?: readonly { readonly at: number; readonly removed: number; readonly lines: readonly Line[] }[];
  readonly state?: State;
  readonly hovered?: number | null;
  readonly outline?: string;
  readonly hoverOutline?: string;
  readonly ghosts?: readonly Ghost[];
  readonly tracks?: Tracks;
  readonly output?: Output;
  readonly notice?: string;
}

export type Standpoint = "script" | "free" | "front" | "side" | "top" | "selection";

export type Ask =
  | { readonly ask: "size"; readonly width: number; readonly height: number }
  | { readonly ask: "shown" | "release" | "keep-camera" | "undo" | "redo" | "render" | "cancel" }
  | { readonly ask: "frame"; readonly frame: number; readonly moving: boolean }
  | { readonly ask: "select" | "remove" | "duplicate" | "hide" | "drop" | "ground" | "lock" | "group"; readonly lines: readonly number[] }
  | { readonly ask: "hover"; readonly x: number; readonly y: number }
  | {
      readonly ask: "press";
      readonly x: number;
      readonly y: number;
      readonly extend: boolean;
      readonly grip: Grip | null;
      readonly line: number | null;
    }
  | { readonly ask: "drag"; readonly x: number; readonly y: number; readonly upright: boolean; readonly snap: boolean; readonly whole: boolean }
  | { readonly ask: "navigate"; readonly how: "turn" | "pan" | "zoom"; readonly x: number; readonly y: number }
  | { readonly ask: "look"; readonly at: Standpoint }
  | {
      readonly ask: "set";
      readonly line: number;
      readonly first: number;
      readonly values: readonly number[];
      readonly gesture: number | null;
    }
  | { readonly ask: "text"; readonly line: number; readonly text: string }
  | { readonly ask: "insert"; readonly at: number; readonly text: string }
  | { readonly ask: "reorder"; readonly line: number; readonly down: boolean }
  | { readonly ask: "rename"; readonly line: number; readonly name: string }
  | { readonly ask: "nudge"; readonly lines: readonly number[]; readonly by: readonly [number, number, number] }
  | { readonly ask: "add"; readonly command: string; readonly at: Point | null }
  | { readonly ask: "load"; readonly from: Source; readonly new: string | null }
  | { readonly ask: "ungroup"; readonly line: number }
  | { readonly ask: "surface"; readonly lines: readonly number[]; readonly material: string }
  | { readonly ask: "preset"; readonly lines: readonly number[]; readonly preset: string }
  | { readonly ask: "time"; readonly wish: TimeWish }
  | { readonly ask: "resolve"; readonly "keep-mine": boolean };

/**
 * Bytes before the pixels of a picture: number, width, height, microseconds, 1 if it is final; then left, top, width and
 * height of the part that differs from the previous picture, whose pixels follow; little-endian.
 */
export const PICTURE_HEADER = 36;
