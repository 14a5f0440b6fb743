import { defineConfig } from "vite";

// Fixed names: three files, which the server knows. The folder keeps its .gitignore.
export default defineConfig({
  base: "./",
  build: {
    emptyOutDir: false,
    modulePreload: false,
    cssCodeSplit: false,
    rollupOptions: {
      output: { entryFileNames: "studio.js", assetFileNames: "studio[extname]", inlineDynamicImports: true },
    },
  },
});
