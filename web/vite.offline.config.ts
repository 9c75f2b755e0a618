import { defineConfig } from "vite";

/** One script and one style sheet, which Python puts into one HTML file together with a robot. */
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
