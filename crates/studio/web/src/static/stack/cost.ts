// The cost of an animation on AWS, as the program estimates it (crates/client/src/cost, docs/cost.md): the same prices, the same
// arithmetic, for a stack with default settings. A test compares both.

import prices from "../../../../../../infra/prices.json";
import type { Section } from "../../runs/runs";

/** What is to be drawn and kept. */
export interface Workload {
  readonly frames: number;
  readonly width: number;
  readonly height: number;
  /** The milliseconds that drawing a frame takes on one processor. */
  readonly drawingMs: number;
  /** The size of a frame's PNG. */
  readonly frameKb: number;
  /** The endings of the files that are made. */
  readonly outputs: readonly string[];
  /** The number of the files beside the scripts, and their size. */
  readonly files: number;
  readonly filesMb: number;
}

const [RENDER_MB, ASSEMBLE_MB] = [1769, 3008] as const;
const PLACES = 1000;
const WAITING_MS = 210;
const WAITING_AT_ONCE_MS = 240;
const FEW_FRAMES = 50;
const GIF_BYTES_A_PIXEL = 0.06;
const Y4M_BYTES_A_PIXEL = 3;
const ASSEMBLE_NS_A_PIXEL = 30;
const ASSEMBLE_OVERHEAD_MS = 1000;
const PUTS_AND_LISTS_A_FRAME = 6;
const PUTS_AND_LISTS_OF_FEW = 8;
const GETS_A_FRAME = 5;
const PAGE = 1000;
const UPLOAD_PART_MB = 8;
const LOG_BYTES = 1500;
const TRACED = 0.05;
const ALARMS = 24;
const SWEEP_S = 0.5;
const MINUTES_A_MONTH = 30 * 24 * 60;
const SWEEPS = MINUTES_A_MONTH / 15;
const QUEUE_POLLS = 5 * MINUTES_A_MONTH * 3;

type Line = Section["lines"][number];

const line = (item: string, amount: number, unit: string, price: number): Line => ({ item, amount, unit, usd: amount * price });
const section = (title: string, lines: readonly Line[]): Section => ({ title, lines, usd: lines.reduce((sum, { usd }) => sum + usd, 0) });
const gbSeconds = (memoryMb: number, ms: number): number => ((memoryMb / 1024) * ms) / 1000;

/** The region and the date of the prices. */
export const priced = `${prices.region} on ${prices.as_of}, in ${prices.currency}`;

/** Returns the milliseconds that the render function takes for a frame. */
export const renderMs = ({ frames, drawingMs }: Workload): number => drawingMs + (PLACES * 2 > frames ? WAITING_AT_ONCE_MS : WAITING_MS);

/** Returns all sections: making the animation, keeping it, and the stack. */
export function estimate(work: Workload): Section[] {
  const { frames, frameKb, outputs, files, filesMb } = work;
  const { lambda, s3, cloudwatch } = prices;
  const pixels = work.width * work.height;
  const framesMb = (frames * frameKb) / 1000;
  const outputMb = (ending: string): number =>
    ending === "gif" ? (frames * pixels * GIF_BYTES_A_PIXEL) / 1e6 : ending === "y4m" ? (frames * pixels * Y4M_BYTES_A_PIXEL) / 1e6 : framesMb;
  const sizes = outputs.map(outputMb);
  const outputsMb = sizes.reduce((sum, size) => sum + size, 0);
  const isGifAlone = outputs.length === 1 && outputs[0] === "gif";
  const assemblingMs = outputs.length * ((frames * pixels * ASSEMBLE_NS_A_PIXEL) / 1e6 + ASSEMBLE_OVERHEAD_MS);
  const uploads = sizes.reduce((sum, size) => sum + Math.ceil(size / UPLOAD_PART_MB) + 2, files);
  const perFrame = frames < FEW_FRAMES ? PUTS_AND_LISTS_OF_FEW : PUTS_AND_LISTS_A_FRAME;
  const pages = Math.ceil(frames / PAGE);
  return [
    section("Making it, once", [
      line("Lambda: invocations", frames + 1, "", lambda.request),
      line("Lambda: rendering", frames * gbSeconds(RENDER_MB, renderMs(work)), "GB-s", lambda.gb_second_x86_64),
      line("Lambda: assembling", gbSeconds(ASSEMBLE_MB, assemblingMs), "GB-s", lambda.gb_second_x86_64),
      line("S3: puts and lists", frames * perFrame + uploads, "", s3.put_copy_post_list),
      line("S3: gets", frames * (GETS_A_FRAME + outputs.length - 1) + Math.min(frames, PLACES) * files, "", s3.get_and_other),
      line("Logs", ((frames + 1) * LOG_BYTES) / 1e9, "GB", cloudwatch.log_gb),
      line("Traces", (frames + 1) * TRACED, "", prices.xray_trace),
      line(isGifAlone ? "Downloading the GIF once" : "Downloading outputs once", outputsMb / 1000, "GB", prices.transfer_out_gb),
    ]),
    section("Keeping it, each month", [
      line(isGifAlone && files === 0 ? "S3: frames and GIF" : "S3: frames, outputs, files", (framesMb + outputsMb + filesMb) / 1000, "GB", s3.standard_gb_month),
      line("S3: lists of the sweep", SWEEPS * (frames / PAGE + 2 * pages), "", s3.put_copy_post_list),
      line("S3: gets of the sweep", SWEEPS * (1 + outputs.length), "", s3.get_and_other),
    ]),
    section("The stack, each month, however many animations", [
      line("Alarms", ALARMS, "", cloudwatch.alarm_month),
      line("Dashboard", 1, "", cloudwatch.dashboard_month),
      line("Schedule of the sweep", SWEEPS, "", prices.scheduler_invocation),
      line("Lambda: sweep invocations", SWEEPS, "", lambda.request),
      line("Lambda: sweeping", SWEEPS * gbSeconds(ASSEMBLE_MB, SWEEP_S * 1000), "GB-s", lambda.gb_second_x86_64),
      line("S3: lists of the sweep", 2 * SWEEPS, "", s3.put_copy_post_list),
      line("Reading the failure queue", QUEUE_POLLS, "", prices.sqs_request),
    ]),
  ];
}
