import react from "@vitejs/plugin-react";
import mantine from "postcss-preset-mantine";
import { defineConfig } from "vite";

const service = process.env["STILLROOM_URL"] ?? "http://127.0.0.1:8000";

// Parts of OpenLayers that nothing here uses but its own modules import: 12 kB of compressed code less.
const withoutUnused = {
  find: /^\.{1,2}\/(control\/defaults|interaction\/defaults|render\/canvas\/style)\.js$/,
  replacement: new URL("./src/viewer/unused.ts", import.meta.url).pathname,
};

export default defineConfig({
  plugins: [react()],
  resolve: { alias: [withoutUnused] },
  css: { postcss: { plugins: [mantine()] } },
  build: {
    outDir: "../server/stillroom/static",
    emptyOutDir: true,
    manifest: true,
    target: "es2022",
    rolldownOptions: {
      // What every page starts with, in one file: many small ones compress worse.
      output: { codeSplitting: { groups: [{ name: "start", tags: ["$initial"] }] } },
    },
  },
  server: {
    host: "127.0.0.1",
    proxy: { "/api": service, "/login": service },
  },
});
