// Writes dist/licenses.txt: the licence of every package whose code is in the bundle, as their terms ask.

import { existsSync, readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import type { Plugin } from "vite";

const PACKAGE = /^(.*\/node_modules\/((?:@[^/]+\/)?[^/]+))\//;

export function licenses(): Plugin {
  return {
    name: "licenses",
    apply: "build",
    generateBundle(_options, bundle) {
      const packages = new Map<string, Bundled>();
      for (const chunk of Object.values(bundle)) {
        if (chunk.type !== "chunk") continue;
        for (const id of chunk.moduleIds) {
          const [, folder, name] = PACKAGE.exec(id.replace("\0", "")) ?? [];
          if (!folder || !name) continue;
          const entry = packages.get(name) ?? { folder, modules: [] };
          entry.modules.push(id.replace("\0", "").replace(/\?.*$/, ""));
          packages.set(name, entry);
        }
      }
      const parts = [...packages].sort(([a], [b]) => (a < b ? -1 : 1)).map(([name, entry]) => describe(name, entry));
      this.emitFile({ type: "asset", fileName: "licenses.txt", source: parts.join("\n\n") });
    },
  };
}

interface Bundled {
  folder: string;
  modules: string[];
}

function describe(name: string, { folder, modules }: Bundled): string {
  const about = JSON.parse(readFileSync(join(folder, "package.json"), "utf8")) as { version: string; license: string };
  const file = readdirSync(folder).find((f) => /^licen[cs]e/i.test(f));
  const text = file ? readFileSync(join(folder, file), "utf8").trim() : notices(modules);
  return `==== ${name} ${about.version} (${about.license.replaceAll(/[()]/g, "")})\n${text}`;
}

/** For a package without a licence file: the different comments that its modules open with. */
function notices(modules: string[]): string {
  const found = new Set<string>();
  for (const path of modules.filter((m) => existsSync(m)).sort()) {
    const opening = /^(?:\s*\/\/[^\n]*\n|\s*\n)+/.exec(readFileSync(path, "utf8"))?.[0] ?? "";
    if (/copyright/i.test(opening)) found.add(opening.replaceAll(/^\s*\/\/ ?/gm, "").trim());
  }
  const longer = (text: string) => [...found].some((other) => other !== text && text.startsWith(other));
  return [...found].filter((text) => !longer(text)).join("\n\n");
}
