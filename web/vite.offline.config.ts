import { defineConfig } from "vite";

/** Builds one script and one style sheet. Python puts them into one HTML file together with a robot. */
export default defineConfig({
  build: {
    target: "es2022",
    outDir: "dist/offline",
    assetsInlineLimit: Number.MAX_SAFE_INTEGER,
    chunkSizeWarningLimit: 900,
    lib: {
      entry: "src/offline/main.ts",
      formats: ["iife"],
      name: "kbot",
      fileName: () => "page.js",
      cssFileName: "page",
    },
  },
});
