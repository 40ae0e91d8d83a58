// Builds the page into dist/, which the server embeds. File names carry no hash, so that a rebuild can be
// compared with what is checked in; the server answers with `Cache-Control: no-cache`.
import { licenses } from "./licenses";
import { defineConfig } from "vitest/config";

export default defineConfig({
  base: "./",
  plugins: [licenses()],
  esbuild: { jsx: "automatic", jsxImportSource: "preact", legalComments: "none" },
  build: {
    target: "es2022",
    outDir: "dist",
    modulePreload: false,
    assetsInlineLimit: 0,
    chunkSizeWarningLimit: 1500,
    rollupOptions: {
      output: {
        entryFileNames: "assets/[name].js",
        chunkFileNames: "assets/[name].js",
        assetFileNames: "assets/[name][extname]",
        manualChunks: (id) => (id.includes("node_modules/three") ? "three" : undefined),
      },
    },
  },
  server: {
    // `npm run dev` serves the page itself and passes calls on to a running server.
    proxy: {
      "/posefuse.v1.Room": { target: process.env["POSEFUSE_SERVER"] ?? "http://127.0.0.1:7400" },
    },
  },
  test: { include: ["src/**/*.test.ts"], environment: "node" },
});
