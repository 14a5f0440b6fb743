// What is submitted, and what it costs: as the program offers it (`runs/offer.rs`).

import { files, notice, state } from "../../store";
import { ownFiles, samples, write } from "../connection";
import { bytesOf, textOf, type File } from "../module";
import { estimate, priced, type Workload } from "./cost";
import { Refused } from "./refused";

/** The most frames that are drawn for an estimate, spread evenly over the animation. */
const SAMPLES = 8;

interface Settings {
  readonly frames?: number;
  readonly outputs?: readonly string[];
}

/** The files that the bucket's folder of a run should have, in the order in which they are sent, and the files that are made. */
export interface Wanted {
  readonly files: readonly File[];
  readonly outputs: readonly string[];
}

function settingsOf(content: Uint8Array): Settings {
  try {
    return JSON.parse(textOf(content)) as Settings;
  } catch {
    throw new Refused("animation.json cannot be read: it is no JSON");
  }
}

export async function wanted(): Promise<Wanted> {
  await write();
  const faulty = files.value.find((file) => file.faulty);
  if (faulty) throw new Refused(`${faulty.name} has an error`, { script: faulty.name.replace(/\.txt$/, "") });
  const frames = state.value?.frames ?? 0;
  if (frames === 0) throw new Refused("nothing is rendered: expected a Trace");
  const [, ...own] = await ownFiles();
  const isScript = ({ name }: File): boolean => name.endsWith(".txt");
  const settings = own.find(({ name }) => name === "animation.json");
  const given = settings ? settingsOf(settings.content) : {};
  if ((given.frames ?? 0) > frames) throw new Refused(`animation.json says ${given.frames} frames, but the scripts give ${frames}`);
  // So that no animation is made before the last script is there.
  const counted = bytesOf(`${JSON.stringify({ frames, ...(settings ? given : { fps: state.value?.fps }) }, null, 2)}\n`);
  const beside = own.filter((file) => !isScript(file) && file !== settings);
  return { files: [{ name: "animation.json", content: counted }, ...beside, ...own.filter(isScript)], outputs: given.outputs ?? ["gif"] };
}

/** The frames that are drawn for an estimate. */
function sampled(): { readonly script: string; readonly frame: number }[] {
  const all = files.value.flatMap(({ name, frames }) => Array.from({ length: frames }, (_, frame) => ({ script: name, frame })));
  const step = Math.max(1, Math.ceil(all.length / SAMPLES));
  return all.filter((_, at) => at % step === 0);
}

/** Draws some frames, and returns what all of them are as work for the functions; nothing if that is not known. */
async function workload({ files: sent, outputs }: Wanted): Promise<Workload | null> {
  const drawn = await samples(sampled());
  if (drawn?.length === 0) notice.value = "There is no estimate of the cost: a frame takes longer than a minute to draw in this browser.";
  if (!drawn?.length) return null;
  const [first] = drawn;
  const other = drawn.find(({ width, height }) => width !== first?.width || height !== first.height);
  if (first && other) {
    const size = ({ script, width, height }: typeof first): string => `${script} is ${width} x ${height}`;
    throw new Refused(`an animation has one size, but ${size(first)} and ${size(other)}: give their scripts the same Screen`);
  }
  const mean = (numbers: readonly number[]): number => numbers.reduce((sum, number) => sum + number, 0) / numbers.length;
  const beside = sent.filter(({ name }) => !name.endsWith(".txt") && name !== "animation.json");
  return {
    frames: state.value?.frames ?? 0,
    width: first?.width ?? 0,
    height: first?.height ?? 0,
    drawingMs: mean(drawn.map(({ ms }) => ms)),
    frameKb: mean(drawn.map(({ bytes }) => bytes)) / 1000,
    outputs,
    files: beside.length,
    filesMb: beside.reduce((sum, { content }) => sum + content.length, 0) / 1e6,
  };
}

/** Returns the cost, as the page shows it; nothing if it is not known. */
export async function estimated(of: Wanted): Promise<object | null> {
  const work = await workload(of);
  if (!work) return null;
  const { frames, width, height, drawingMs } = work;
  const prices = `${priced}; drawn by this browser, which takes longer than the functions`;
  return { frames, size: [width, height], drawingMs, prices, sections: estimate(work) };
}
