// The variants of the module. `relaxed.wasm` multiplies and adds in one instruction, and may run only where that rounds once: then
// it draws the same pictures as `rayfold.wasm`, which computes them from plain instructions, several times as slowly.

/** A module with a function of x and y: whether x² + c, with relaxed instructions, keeps the bits that rounding x² would lose. */
const TEST = "AGFzbQEAAAABBwFgAn18AX8DAgEABwQBAAAACkMBQQAgAP0TIAD9E0MAEIC//RP9hQL9HwBDAAAAAFwgAf0UIAH9FEQAAAAEAADwv/0U/YcC/SEARAAAAAAAAAAAYnEL";

function isFused(): boolean {
  const bytes = Uint8Array.from(atob(TEST), (letter) => letter.charCodeAt(0));
  if (!WebAssembly.validate(bytes)) return false;
  const { exports } = new WebAssembly.Instance(new WebAssembly.Module(bytes));
  const test = exports[""] as (x: number, y: number) => number;
  return test(1 + 2 ** -12, 1 + 2 ** -27) === 1;
}

/** The file of the variant for this machine. */
export const moduleFile = isFused() ? "relaxed.wasm" : "rayfold.wasm";
