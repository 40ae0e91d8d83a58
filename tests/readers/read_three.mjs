// GLB, FBX and BVH by the loaders of three.js in headless Chromium: where their bones are, and a picture of each.
//
// node read_three.mjs EXPECTED.json OUT.json POSEFUSE; pictures go to target/screenshots/readers.
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { dirname, extname, join, normalize } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, "../..");
const modules = join(root, "web/node_modules");
const pictures = join(root, "target/screenshots/readers");
const { chromium } = await import(pathToFileURL(join(modules, "playwright-core/index.mjs")));

const expected = JSON.parse(readFileSync(process.argv[2], "utf8"));
const TYPES = { ".html": "text/html", ".mjs": "text/javascript", ".js": "text/javascript" };
const BROWSERS = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
const FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-background-networking"];

// What is shown: an export, how its files end, how many metres a unit of theirs is, and how they are called in the table.
const SHOWS = [
  { name: "glb", export: "blender", metres: 1, what: "GLB in three.js" },
  { name: "fbx", export: "unity", metres: 0.01, what: "FBX (unity) in three.js" },
  { name: "fbx", export: "unreal", metres: 0.01, what: "FBX (unreal) in three.js" },
  { name: "bvh", export: "plain", metres: 0.01, what: "BVH in three.js" },
];

// Serves the page, three.js and the exported files, and nothing else.
function serve() {
  const known = new Set(Object.values(expected.files).flat().map((file) => file.path));
  const server = createServer((request, response) => {
    const path = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
    const roots = { "/three/": join(modules, "three"), "/page/": join(here, "three") };
    const prefix = Object.keys(roots).find((prefix) => path.startsWith(prefix));
    let file = path.startsWith("/file") ? path.slice("/file".length) : join(here, "three/index.html");
    if (prefix) file = normalize(join(roots[prefix], path.slice(prefix.length)));
    if ((path.startsWith("/file") && !known.has(file)) || !existsSync(file)) return response.writeHead(404).end();
    response.writeHead(200, { "content-type": TYPES[extname(file)] ?? "application/octet-stream" }).end(readFileSync(file));
  });
  return new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(server)));
}

// The rig's bones by the names that three.js gives those of the export.
function boneOf(name) {
  const called = expected.bone_names[name] ?? expected.names.bones;
  const tidy = (name) => name.replace(/\s/g, "_").replace(/[[\].:/]/g, "");
  const bones = new Map(called.map((name, index) => [tidy(name), expected.names.bones[index]]));
  // The bones of a second person in the same file get a number.
  return (found) => bones.get(found) ?? bones.get(found.replace(/_\d+$/, ""));
}

async function show(page, { name, export: from, metres, what }) {
  const files = expected.files[from].filter((file) => file.path.endsWith(`.${name}`));
  const urls = files.map((file) => ({ url: `/file${file.path}`, kind: name }));
  const counts = await page.evaluate(([urls, metres]) => window.reader.load(urls, metres), [urls, metres]);
  files.forEach((file, index) => {
    if (counts[index] !== file.people.length) throw new Error(`${file.path}: ${counts[index]} people, ${file.people.length} were sent`);
  });
  const times = expected.sampled.map((frame) => frame / expected.rate_hz);
  const found = await page.evaluate((times) => window.reader.places(times), times);
  const bone = boneOf(from);
  const people = {};
  files.flatMap((file) => file.people).forEach((who, index) => {
    const named = Object.entries(found[index]).map(([name, places]) => [bone(name), places]);
    people[who] = Object.fromEntries(named.filter(([name]) => name !== undefined));
  });
  const label = `${what}, ${times[times.length >> 1].toFixed(2)} s`;
  const share = await page.evaluate(([seconds, label]) => window.reader.draw(seconds, label), [times[times.length >> 1], label]);
  await page.screenshot({ path: join(pictures, `three-${from}-${name}.png`) });
  if (!(share > 0.001)) throw new Error(`${what}: nobody is in the picture (${share} of it changed)`);
  return { what, kind: "bones", people, axes: "y-up", metres: 1, frames: null, sent: null };
}

mkdirSync(pictures, { recursive: true });
const server = await serve();
const executablePath = process.env.CHROMIUM ?? BROWSERS.find((path) => existsSync(path));
const browser = await chromium.launch({ executablePath, headless: true, args: FLAGS });
try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
  page.on("pageerror", (error) => console.error(`page: ${error}`));
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await page.waitForFunction(() => window.reader);
  const readings = [];
  for (const each of SHOWS) readings.push(await show(page, each));
  writeFileSync(process.argv[3], JSON.stringify(readings));
} finally {
  await browser.close();
  server.close();
}
