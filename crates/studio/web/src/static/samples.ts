// Frames that are drawn for an estimate of the cost, one after the other on one thread.

import { Helper } from "./helper";
import type { FramePlace, Post, Sample } from "./messages";
import { Call, bytesOf, packed, type File, type Program } from "./module";

/** Milliseconds after which no further frame is begun. The first is drawn in any case. */
const ENOUGH = 3000;

/** Milliseconds after which the first is given up. */
const PATIENCE = 60_000;

/** Draws frames of a project, each twice if there is time. Returns none if the first takes too long. */
export async function sampled(program: Program, page: Post, files: readonly File[], frames: readonly FramePlace[]): Promise<Sample[]> {
  const helper = new Helper(program, page);
  const samples: Sample[] = [];
  const begun = performance.now();
  const isLate = (): boolean => performance.now() - begun > ENOUGH;
  let isOver = false;
  const limit = setTimeout(() => {
    isOver = true;
    helper.end();
  }, PATIENCE);
  try {
    helper.tell(Call.put, packed(files));
    for (const { script, frame } of frames) {
      if (samples.length > 0 && isLate()) break;
      let ms = Infinity;
      let png: Uint8Array | null = null;
      for (let time = 0; time < 2 && !(png && isLate()); time += 1) {
        const start = performance.now();
        png = await helper.call(Call.draw, 0, bytesOf(JSON.stringify({ frame: { script, frame } })));
        ms = Math.min(ms, performance.now() - start);
      }
      if (!png?.length) throw new Error(`frame ${frame + 1} of ${script} cannot be drawn`);
      const size = new DataView(png.buffer, png.byteOffset + 16);
      samples.push({ script, frame, ms, bytes: png.length, width: size.getUint32(0), height: size.getUint32(4) });
    }
  } catch (error) {
    // A worker that was ended fails its calls.
    if (!isOver) throw error;
  } finally {
    clearTimeout(limit);
    helper.end();
  }
  return samples;
}
