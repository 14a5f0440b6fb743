// Keeps the site in the browser from its start page on, so that the studio opens without a network.

/** A module with relaxed instructions. Where they do not round as needed, the studio registers the other module when it is opened. */
const RELAXED = "AGFzbQEAAAABBwFgAn18AX8DAgEABwQBAAAACkMBQQAgAP0TIAD9E0MAEIC//RP9hQL9HwBDAAAAAFwgAf0UIAH9FEQAAAAEAADwv/0U/YcC/SEARAAAAAAAAAAAYnEL";

const isRelaxed = WebAssembly.validate(Uint8Array.from(atob(RELAXED), (letter) => letter.charCodeAt(0)));
navigator.serviceWorker?.register(`offline.js?${isRelaxed ? "relaxed" : "rayfold"}.wasm`).catch(() => undefined);
