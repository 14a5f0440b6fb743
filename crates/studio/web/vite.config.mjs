import { join } from "node:path";

import { defineConfig } from "vite";

import { lean, REPLACED } from "./lean.mjs";
import { privateNames } from "./shorten.mjs";

const own = (name) => join(import.meta.dirname, "src", name);

// Fixed names: three files, which the server knows.
export default defineConfig({
  base: "./",
  plugins: [lean()],
  resolve: { alias: { ...REPLACED, "#connection": own("connection/socket.ts"), "#drawn": own("connection/drawn.tsx"), "#runs": own("connection/runs.ts") } },
  build: {
    modulePreload: false,
    cssCodeSplit: false,
    // `light-dark()` stays, which follows the page's own choice of a theme.
    target: ["chrome123", "firefox125", "safari17.5"],
    rollupOptions: {
      // The parsers of other languages, of which the editor's commands import a name, are left out.
      treeshake: { moduleSideEffects: (id) => !id.includes("/@lezer/") },
      output: {
        entryFileNames: "studio.js",
        assetFileNames: "studio[extname]",
        codeSplitting: false,
        minify: { compress: true, mangle: true, mangleProps: { include: privateNames() }, codegen: { removeWhitespace: true } },
      },
    },
  },
});
