// The session of a page in a worker: carries messages between the page, the module with the session, and the workers that
// draw; and keeps the files.

import type { OutputState, ServerMessage } from "../protocol";
import { Film } from "./film";
import { Helper } from "./helper";
import type { FramePlace, Place, Post, Question, Sample, ToDesk } from "./messages";
import { Call, Fault, Module, bytesOf, packed, textOf, unpacked, type File, type Program } from "./module";
import { Folder, keep, project, projects, remove } from "./projects";
import { sampled } from "./samples";

/** The milliseconds between two looks at the files. */
const TICK = 250;

/** The milliseconds between two looks at the files of a folder on the disk. */
const DISK = 1000;

/** The milliseconds until a file that could not be written is tried again. */
const AGAIN = 2000;

/** The milliseconds for which another page may write before its project is taken over. */
const PATIENCE = 2000;

/** The most workers that draw. */
const MOST = 8;

/** What the session wants done, as `written` in crates/web numbers it. */
const Kind = { tell: 0, show: 1, put: 2, draw: 3, save: 4, answer: 5, wake: 6, film: 7 } as const;

const why = (error: unknown): string => (error instanceof Error ? error.message : String(error));

export class Session {
  readonly #post: Post;
  /** Messages that came before the session was open. */
  #early: ToDesk[] | null = [];
  #program: Program | null = null;
  #module: Module | null = null;
  #drawers: Helper[] = [];
  #folder = new Folder(null);
  /** Why files are not kept. */
  #refusal = "";
  /** The time at which each file on the disk was last modified, as far as it is known here. */
  #times: Map<string, number> | null = null;
  /** The newest contents of files that are not written yet. */
  readonly #unwritten = new Map<string, File>();
  /** The writing in progress: one file after the other. */
  #writing: Promise<void> = Promise.resolve();
  #waking = 0;
  #film: Film | null = null;
  #made: Uint8Array = new Uint8Array();
  /** The questions that the module answers, by their numbers. */
  readonly #asked = new Set<number>();

  constructor(post: Post) {
    this.#post = post;
  }

  take(message: ToDesk): void {
    if (typeof message !== "string" && message.is === "open") {
      this.#open(message.module, message.place).catch((error: unknown) => this.#post({ is: "closed", why: why(error) }));
    } else if (this.#early) this.#early.push(message);
    else if (typeof message === "string") this.#do(Call.hear, 0, bytesOf(message));
    else void this.#answer(message.number, message.question);
  }

  async #open(address: string, place: Place): Promise<void> {
    const [compiled, font] = await Promise.all([compile(address), load(new URL("font.ttf", address).href)]);
    const program = { module: compiled, font: new Uint8Array(await font.arrayBuffer()) };
    this.#program = program;
    this.#module = new Module(program);
    const { name, files } = await this.#files(place);
    const workers = Math.min(Math.max(1, navigator.hardwareConcurrency), MOST);
    this.#drawers = Array.from({ length: workers }, () => new Helper(program, this.#post));
    this.#post({ is: "opened", project: name, folder: place.is === "folder" });
    this.#do(Call.open, workers, packed([{ name, content: new Uint8Array() }, ...files]));
    if (!this.#folder.isKept) this.#tell({ notice: `This browser keeps no files${this.#refusal && `: ${this.#refusal}`}. Save the project as a zip file.` });
    const early = this.#early ?? [];
    this.#early = null;
    for (const message of early) this.take(message);
    setInterval(() => this.#do(Call.tick, 0), TICK);
    if (place.is === "folder") this.#look();
  }

  /** Takes a place over from another page, and reads its files. Those from outside become a project of the browser. */
  async #files(place: Place): Promise<{ readonly name: string; readonly files: readonly File[] }> {
    if (place.is === "folder") {
      const { name } = place.handle;
      await this.#takeOver(`folder ${name}`);
      this.#folder = new Folder(place.handle);
      const { files, leftOut } = await this.#folder.files();
      this.#times = await this.#folder.times();
      for (const { name, modified } of files) this.#times.set(name, modified);
      if (leftOut.length > 0) this.#tell({ notice: `The studio cannot hold all of this folder. It leaves out ${leftOut.join(", ")}.` });
      return { name, files };
    }
    if (place.is === "project") {
      const name = place.name ?? (await projects())[0] ?? "scene";
      await this.#takeOver(name);
      this.#folder = await project(name);
      return { name, files: (await this.#folder.files()).files };
    }
    let files: readonly File[];
    if (place.is === "files") files = place.files;
    else {
      const answer = await fetch(place.address);
      if (!answer.ok) throw new Error(`there is no example ${place.name}`);
      files = this.#unzip(new Uint8Array(await answer.arrayBuffer())).slice(1);
    }
    try {
      const name = await keep(place.name, files);
      await this.#takeOver(name);
      this.#folder = await project(name);
      return { name, files: this.#folder.isKept ? (await this.#folder.files()).files : files };
    } catch (error) {
      // As where the storage is full.
      this.#refusal = why(error);
      return { name: place.name, files };
    }
  }

  /** Lets one page work on a project: a new one takes over, once the other has written what it has. */
  async #takeOver(name: string): Promise<void> {
    let release = (): void => undefined;
    const held = navigator.locks.request(`rayfold ${name}`, { steal: true }, () => new Promise<never>(() => undefined));
    held.catch(() => {
      this.#tell({ notice: "Another page has taken over; this one rests." });
      this.#post({ is: "closed", why: "" });
      this.#film?.cancel();
      for (const drawer of this.#drawers) drawer.end();
      this.#do(Call.tick, 1);
      this.#module = null;
      void this.#writing.then(() => {
        // What could not be written is the other page's now.
        this.#unwritten.clear();
        release();
      });
    });
    await new Promise<void>((done) => {
      const writes = (): Promise<void> => {
        done();
        return new Promise((ended) => (release = ended));
      };
      navigator.locks.request(`rayfold ${name} is written`, { signal: AbortSignal.timeout(PATIENCE) }, writes).catch(() => done());
    });
  }

  /** Takes files that other programs have written to a folder on the disk. */
  #look(): void {
    const look = async (): Promise<void> => {
      const [known, now] = [this.#times ?? new Map<string, number>(), await this.#folder.times()];
      for (const [name, time] of now) {
        const before = known.get(name);
        if (before === time) continue;
        known.set(name, time);
        // The session takes no further scripts.
        if (before === undefined && name.endsWith(".txt")) this.#tell({ notice: `${name} is new in the folder. Load the page again to see it.` });
        else this.#do(Call.insert, 0, packed([{ name, content: await this.#folder.read(name) }]));
      }
      for (const name of known.keys()) {
        if (now.has(name)) continue;
        known.delete(name);
        this.#tell({ notice: `${name} was deleted from the folder. What is here is written with its next change.` });
      }
    };
    const again = (): unknown => setTimeout(() => void look().catch(() => undefined).then(again), DISK);
    again();
  }

  /** The names of files that are left out, as the content of a file without name, and the files. */
  #unzip(zip: Uint8Array): File[] {
    return unpacked(this.#call(Call.unzip, 0, zip));
  }

  #call(what: number, number = 0, bytes?: Uint8Array): Uint8Array {
    if (!this.#module) throw new Error("no project is open");
    return this.#module.call(what, number, bytes).slice();
  }

  /** Makes a call of the session, and does what it wants done. */
  #do(what: number, number = 0, bytes?: Uint8Array): void {
    if (!this.#module) return;
    let effects: Uint8Array;
    try {
      effects = this.#call(what, number, bytes);
    } catch (error) {
      this.#module = null;
      this.#post({ is: "closed", why: why(error) });
      return;
    }
    const view = new DataView(effects.buffer);
    for (let at = 0; at < effects.length; ) {
      const [kind, number, length] = [0, 4, 8].map((offset) => view.getUint32(at + offset, true)) as [number, number, number];
      const content = effects.slice(at + 12, at + 12 + length);
      at += 12 + length;
      this.#follow(kind, number, content);
    }
  }

  #follow(kind: number, number: number, content: Uint8Array<ArrayBuffer>): void {
    if (kind === Kind.tell) this.#post(textOf(content));
    else if (kind === Kind.show) this.#post(content.buffer, [content.buffer]);
    else if (kind === Kind.put) this.#drawers[number]?.tell(Call.put, content);
    else if (kind === Kind.draw) {
      const drawn = (bytes: Uint8Array): void => this.#do(Call.drawn, number, bytes);
      const failed = (error: unknown): void => {
        // What cannot be drawn is not shown: the session tells the errors of a script.
        if (error instanceof Fault) this.#replace(number, error);
        else drawn(new Uint8Array());
      };
      this.#drawers[number]?.call(Call.draw, 0, content).then(drawn, failed);
    } else if (kind === Kind.save) {
      for (const file of unpacked(content)) this.#write(file);
    } else if (kind === Kind.answer) {
      if (this.#asked.delete(number)) this.#post({ is: "answer", number, value: content }, [content.buffer]);
    } else if (kind === Kind.wake) {
      clearTimeout(this.#waking);
      this.#waking = setTimeout(() => this.#do(Call.tick, 0), number);
    } else if (kind === Kind.film) {
      if (content.length === 0) this.#film?.cancel();
      else void this.#render(textOf(content) as "gif" | "apng" | "webp");
    }
  }

  /** Starts a new worker in place of one that has failed. */
  #replace(number: number, fault: Fault): void {
    if (!this.#module || !this.#program) return;
    this.#tell({ notice: `This cannot be drawn, because the tracer has failed: ${fault.message}` });
    this.#drawers[number]?.end();
    this.#drawers[number] = new Helper(this.#program, this.#post);
    this.#do(Call.lost, number);
  }

  /** Writes a file after those before it. What cannot be written is tried again, until a newer content of the file is. */
  #write(file: File): void {
    this.#unwritten.set(file.name, file);
    this.#writing = this.#writing.then(() => this.#put(file));
  }

  async #put(file: File, isFirst = true): Promise<void> {
    const { name } = file;
    if (this.#unwritten.get(name) !== file) return;
    try {
      const known = this.#times?.get(name);
      const now = known === undefined ? null : await this.#folder.time(name);
      if (now === null || now === known) {
        await this.#folder.write(file);
        const time = this.#times && (await this.#folder.time(name));
        if (time !== null) this.#times?.set(name, time);
      } else this.#tell({ notice: `Another program has changed ${name} at the same time, and its version is shown. Undo restores yours.` });
      if (this.#unwritten.get(name) === file) this.#unwritten.delete(name);
    } catch (error) {
      if (isFirst) this.#tell({ notice: `${name} cannot be written: ${why(error)}. It is tried again; a zip file keeps it, too.` });
      setTimeout(() => (this.#writing = this.#writing.then(() => this.#put(file, false))), AGAIN);
    }
  }

  #tell(message: Partial<ServerMessage>): void {
    this.#post(JSON.stringify(message));
  }

  async #render(format: "gif" | "apng" | "webp"): Promise<void> {
    if (this.#film) return;
    const report = (output: OutputState): void => this.#tell({ output });
    const film = this.#newFilm();
    this.#film = film;
    try {
      this.#made = await film.make(this.#filesFor(format), (done, of) => report({ is: "running", done, of }));
      report({ is: "done", bytes: this.#made.length, format });
    } catch (error) {
      report(film.isCancelled ? { is: "cancelled" } : { is: "failed", why: why(error) });
    } finally {
      this.#film = null;
    }
  }

  /** Puts files into the project. The session takes no further scripts. */
  async #add(files: readonly File[]): Promise<boolean> {
    const known = new Set(unpacked(this.#call(Call.files)).map(({ name }) => name));
    const isNew = ({ name }: File): boolean => name.endsWith(".txt") && !known.has(name);
    for (const file of files) {
      if (!isNew(file)) this.#do(Call.insert, 0, packed([file]));
      this.#write(file);
    }
    await this.#writing;
    return files.some(isNew);
  }

  async #samples(frames: readonly FramePlace[]): Promise<Sample[]> {
    if (!this.#program) throw new Error("no project is open");
    const [, ...files] = unpacked(this.#call(Call.files));
    return sampled(this.#program, this.#post, files, frames);
  }

  #newFilm(): Film {
    if (!this.#program) throw new Error("no project is open");
    return new Film(this.#program, this.#post, Math.min(Math.max(1, navigator.hardwareConcurrency), MOST));
  }

  /** The files of the project, after one whose name is the format of an animation. */
  #filesFor(format: string): Uint8Array {
    const [, ...files] = unpacked(this.#call(Call.files));
    return packed([{ name: format, content: new Uint8Array() }, ...files]);
  }

  async #answer(number: number, question: Question): Promise<void> {
    try {
      if (question.is === "get" && !["animation", "frames.zip"].includes(question.address)) {
        this.#asked.add(number);
        this.#do(Call.get, number, bytesOf(question.address));
      } else this.#post({ is: "answer", number, value: await this.#know(question) });
    } catch (error) {
      this.#tell({ notice: why(error) });
      this.#post({ is: "answer", number, value: null });
    }
  }

  async #know(question: Question): Promise<unknown> {
    switch (question.is) {
      case "get":
        return question.address === "animation" ? this.#made : this.#newFilm().make(this.#filesFor("frames"), () => undefined);
      case "files":
        return unpacked(this.#call(Call.files));
      case "projects":
        return projects();
      case "remove":
        return remove(question.name);
      case "zip": {
        const [, ...files] = unpacked(this.#call(Call.files));
        return this.#call(Call.zip, 0, packed(files));
      }
      case "samples":
        return this.#samples(question.frames);
      case "unzip":
        return this.#unzip(question.content);
      case "add":
        return this.#add(question.files);
      case "import":
        return keep(question.name, question.files);
      case "write":
        this.#do(Call.tick, 1);
        return this.#writing;
    }
  }
}

async function load(address: string): Promise<Response> {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error(`${address} cannot be loaded`);
  return answer;
}

/** Compiles the module, also from a host that does not know its media type. */
async function compile(address: string): Promise<WebAssembly.Module> {
  const answer = await load(address);
  if (answer.headers.get("content-type") === "application/wasm") return WebAssembly.compileStreaming(answer);
  return WebAssembly.compile(await answer.arrayBuffer());
}
