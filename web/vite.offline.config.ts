import { defineConfig } from "vite";

import { listPackages } from "./list-packages.ts";

/** Builds one script and one style sheet. Python puts them into one HTML file together with a robot. */
export default defineConfig({
  plugins: [listPackages()],
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
