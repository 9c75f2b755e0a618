import { defineConfig } from "vite";

import { listPackages } from "./list-packages.ts";

export default defineConfig({
  base: "./",
  plugins: [listPackages()],
  build: {
    target: "es2022",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 900,
  },
  server: { proxy: { "/ws": { target: "ws://127.0.0.1:8300", ws: true }, "/mesh": "http://127.0.0.1:8300" } },
});
