// Reads a BVH, FBX or GLB with three.js and prints where its bones are, as JSON: for each time of the command line and each
// person an object of name and [x, y, z], in the units of the file.
//
// node read_with_three.mjs NODE_MODULES FILE TIME...
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [modules, file, ...times] = process.argv.slice(2);
const load = (path) => import(pathToFileURL(`${modules}/three/${path}`));
// Loaders look for a page to find out what its textures can be; there are none here.
globalThis.self ??= globalThis;
globalThis.window ??= globalThis;
const { AnimationMixer, Vector3 } = await load("build/three.module.js");

const bytes = readFileSync(file);
const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);

async function read() {
  if (file.endsWith(".glb")) {
    const { GLTFLoader } = await load("examples/jsm/loaders/GLTFLoader.js");
    const { scene, animations } = await new GLTFLoader().parseAsync(buffer, "");
    return { root: scene, clips: animations };
  }
  if (file.endsWith(".fbx")) {
    const { FBXLoader } = await load("examples/jsm/loaders/FBXLoader.js");
    const root = new FBXLoader().parse(buffer, "");
    return { root, clips: root.animations };
  }
  const { BVHLoader } = await load("examples/jsm/loaders/BVHLoader.js");
  const { skeleton, clip } = new BVHLoader().parse(bytes.toString());
  return { root: skeleton.bones[0], clips: [clip] };
}

const { root, clips } = await read();
const mixer = new AnimationMixer(root);
for (const clip of clips) mixer.clipAction(clip).play();
const isHips = (node) => node.isBone && !node.parent?.isBone;
const people = [];
root.traverse((node) => isHips(node) && people.push(node));
const frames = times.map((time) => {
  mixer.setTime(Number(time));
  root.updateMatrixWorld(true);
  return people.map((hips) => {
    const bones = {};
    hips.traverse((bone) => {
      // Bones of a second person get a number, because names are unique there.
      const name = bone.name.replace(/_\d+$/, "");
      if (bone.isBone && !(name in bones)) bones[name] = bone.getWorldPosition(new Vector3()).toArray();
    });
    return bones;
  });
});
process.stdout.write(JSON.stringify({ clips: clips.length, people: people.length, frames }));
