// GLB by the Khronos glTF validator: no error, no warning.
//
// node read_validator.mjs EXPECTED.json OUT.json POSEFUSE MODULES
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { basename, join } from "node:path";

const [described, out, , modules] = process.argv.slice(2);
const validator = createRequire(join(modules, "here.js"))("gltf-validator");
const { files } = JSON.parse(readFileSync(described, "utf8"));
const readings = [];
for (const { path } of Object.values(files).flat().filter((file) => file.path.endsWith(".glb"))) {
  const { issues, info } = await validator.validateBytes(new Uint8Array(readFileSync(path)), { uri: basename(path) });
  if (issues.numErrors + issues.numWarnings > 0) throw new Error(`${path}: ${JSON.stringify(issues, null, 2)}`);
  if (!(info.animationCount === 1 && info.hasSkins)) throw new Error(`${path}: ${JSON.stringify(info)}`);
  const said = `no error, no warning, ${issues.numInfos} remarks; ${info.drawCallCount} figures, one animation`;
  readings.push({ what: `GLB by the Khronos validator ${validator.version()}`, check: said });
}
writeFileSync(out, JSON.stringify(readings));
