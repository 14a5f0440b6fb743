import { join } from "node:path";

import { defineConfig } from "vite";

import { lean, REPLACED } from "./lean.mjs";
import { privateNames } from "./shorten.mjs";

const own = (name) => join(import.meta.dirname, "src", name);
const minify = { compress: true, mangle: true, codegen: { removeWhitespace: true } };

// The page without a program (`cargo xtask site`): the same sources, with a studio in its workers.
export default defineConfig({
  root: join(import.meta.dirname, "site"),
  base: "./",
  plugins: [lean()],
  resolve: { alias: { ...REPLACED, "#connection": own("static/connection.ts"), "#drawn": own("static/drawn.tsx"), "#runs": own("static/stack/runs.ts") } },
  worker: { format: "es", rollupOptions: { output: { entryFileNames: "worker.js", minify } } },
  build: {
    outDir: join(import.meta.dirname, "../../../target/site"),
    emptyOutDir: true,
    modulePreload: false,
    cssCodeSplit: false,
    target: ["chrome123", "firefox125", "safari17.5"],
    rollupOptions: {
      input: join(import.meta.dirname, "site/studio.html"),
      treeshake: { moduleSideEffects: (id) => !id.includes("/@lezer/") },
      output: {
        entryFileNames: "studio.js",
        assetFileNames: "studio[extname]",
        codeSplitting: false,
        minify: { ...minify, mangle: true, mangleProps: { include: privateNames() } },
      },
    },
  },
});
