// An animation: some workers draw its frames, ahead of the one that encodes them in order.

import { Helper } from "./helper";
import type { Post } from "./messages";
import { Call, type Program } from "./module";

const NONE = (): Uint8Array => new Uint8Array();

export class Film {
  readonly #encoder: Helper;
  readonly #drawers: Helper[];
  #isCancelled = false;

  constructor(program: Program, page: Post, drawers: number) {
    this.#encoder = new Helper(program, page);
    this.#drawers = Array.from({ length: drawers }, () => new Helper(program, page));
  }

  get isCancelled(): boolean {
    return this.#isCancelled;
  }

  cancel(): void {
    this.#isCancelled = true;
    this.#end();
  }

  /** Makes the file of a project. `project` is its files, after one whose name is the format. */
  async make(project: Uint8Array, report: (done: number, of: number) => void): Promise<Uint8Array> {
    try {
      const all = [this.#encoder, ...this.#drawers];
      const [counts] = await Promise.all(all.map((helper) => helper.call(Call.begin, 0, project.slice())));
      const count = counts ? new DataView(counts.buffer).getUint32(0, true) : 0;
      report(0, count);
      const frames = new Map<number, Promise<Uint8Array>>();
      let next = 0;
      const drawNext = (helper: Helper): void => {
        if (next >= count) return;
        const frame = helper.call(Call.frame, next, NONE());
        // Who awaits it hears of it.
        frame.catch(() => undefined);
        frames.set(next, frame);
        next += 1;
      };
      // Each worker draws a frame and has another one waiting.
      for (let round = 0; round < 2; round += 1) this.#drawers.forEach(drawNext);
      for (let done = 0; done < count; done += 1) {
        const frame = await (frames.get(done) ?? Promise.reject(new Error("a frame is missing")));
        frames.delete(done);
        const drawer = this.#drawers[done % this.#drawers.length];
        if (drawer) drawNext(drawer);
        await this.#encoder.call(Call.push, 0, frame);
        report(done + 1, count);
      }
      return await this.#encoder.call(Call.finish, 0, NONE());
    } finally {
      this.#end();
    }
  }

  #end(): void {
    for (const helper of [this.#encoder, ...this.#drawers]) helper.end();
  }
}
