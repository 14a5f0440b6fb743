// The page's modules, loaded without a browser.

import { join } from "node:path";
import { after } from "node:test";

import { createServer } from "vite";

const root = join(import.meta.dirname, "..");
const alias = { "#connection": join(root, "src/connection/socket.ts"), "#drawn": join(root, "src/connection/drawn.tsx"), "#runs": join(root, "src/connection/runs.ts") };

// Nothing is bundled before, so nothing is searched for what could be.
const optimizeDeps = { noDiscovery: true };
const server = await createServer({ root, configFile: false, resolve: { alias }, optimizeDeps, appType: "custom", logLevel: "error", server: { middlewareMode: true, hmr: false, ws: false } });
after(() => server.close());

/** A module of `src`. */
export const load = (path) => server.ssrLoadModule(`/src/${path}`);
