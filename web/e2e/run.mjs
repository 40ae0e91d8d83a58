// Drives the page of a real server in headless Chromium: npm run e2e -- http://127.0.0.1:PORT outdir [options]
//
// Assumes a running `posefuse demo` (four sensors, calibrated or about to be, one person or more). With
// --expect-empty it assumes a server that no agent has joined, and checks only that.
// Saves screenshots to outdir. Exit code 0: all passed; 1: a check failed; 2: wrong usage or no browser.

import { mkdir } from "node:fs/promises";
import { existsSync } from "node:fs";
import { parseArgs } from "node:util";
import { chromium } from "playwright-core";
import { depthRoom, emptyRoom, fullRoom } from "./checks.mjs";
import { Report } from "./report.mjs";

const USAGE = `usage: npm run e2e -- URL OUTDIR [--expect-empty | --expect-depth] [--sensors N] [--wait SECONDS]
  --expect-empty   the server has no sensor: check what the page says then, and nothing else
  --expect-depth   the sensors have depth previews: check these, and nothing else
  --sensors N      how many live sensors to wait for (4)
  --wait SECONDS   how long to wait for sensors, calibration and a person (120)
  CHROMIUM         environment: the browser to use, if not found by itself`;

const FLAGS = [
  "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking",
  "--disable-component-update", "--disable-sync", "--no-first-run", "--disable-quic",
];
const BROWSERS = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

function usage(problem) {
  console.error(`e2e: ${problem}\n${USAGE}`);
  process.exit(2);
}

function options() {
  try {
    const { values, positionals } = parseArgs({
      allowPositionals: true,
      options: {
        "expect-empty": { type: "boolean", default: false },
        "expect-depth": { type: "boolean", default: false },
        sensors: { type: "string", default: "4" },
        wait: { type: "string", default: "120" },
      },
    });
    if (positionals.length !== 2) usage(`expected a URL and a folder, found ${positionals.length} arguments`);
    return {
      url: new URL(positionals[0]), out: positionals[1], empty: values["expect-empty"], depth: values["expect-depth"],
      sensors: Number(values.sensors), waitMs: 1000 * Number(values.wait),
    };
  } catch (error) {
    return usage(error.message);
  }
}

const opts = options();
const executablePath = process.env.CHROMIUM ?? BROWSERS.find((path) => existsSync(path));
if (!executablePath) usage(`found no browser at ${BROWSERS.join(", ")}: install chromium or set CHROMIUM`);
await mkdir(opts.out, { recursive: true });

const browser = await chromium.launch({ executablePath, headless: true, args: FLAGS });
const report = new Report(opts);
try {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, colorScheme: "dark" });
  context.setDefaultTimeout(10_000);
  const page = await context.newPage();
  report.watch(page);
  await report.step("the page opens", async () => {
    const answer = await page.goto(opts.url.href);
    if (!answer?.ok()) throw new Error(`GET ${opts.url.href} answered ${answer?.status()}`);
    await page.getByTestId("connection").waitFor();
  });
  await (opts.empty ? emptyRoom : opts.depth ? depthRoom : fullRoom)(page, report, opts);
  report.finish();
} finally {
  await browser.close();
}
process.exit(report.failed ? 1 : 0);
