// Shows files as three.js loads them, and says where their bones are. Y up; a grid of half metres lies on the floor, with
// axes of a metre: X red, Y green, Z blue. `window.reader` is what read_three.mjs calls.
import * as THREE from "three";
import { BVHLoader } from "three/addons/loaders/BVHLoader.js";
import { FBXLoader } from "three/addons/loaders/FBXLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);

const LOADERS = {
  async glb(url) {
    const { scene, animations } = await new GLTFLoader().loadAsync(url);
    return { root: scene, clips: animations };
  },
  async fbx(url) {
    const root = await new FBXLoader().loadAsync(url);
    return { root, clips: root.animations };
  },
  async bvh(url) {
    const { skeleton, clip } = await new BVHLoader().loadAsync(url);
    const root = new THREE.Group();
    root.add(skeleton.bones[0]);
    return { root, clips: [clip] };
  },
};

let scene, mixers, people;

function emptyStage() {
  scene = new THREE.Scene();
  scene.background = new THREE.Color(0x14181d);
  scene.add(new THREE.GridHelper(8, 16, 0x6b7785, 0x39424d), new THREE.HemisphereLight(0xffffff, 0x445566, 2.5));
  scene.add(new THREE.AxesHelper(1));
  mixers = [];
  people = [];
}

// Loads files, each with `metres` a unit; gives how many people each has, in order.
async function load(files, metres) {
  emptyStage();
  const counts = [];
  for (const { url, kind } of files) {
    const { root, clips } = await LOADERS[kind](url);
    if (clips.length !== 1) throw new Error(`${url}: one animation was expected, found ${clips.length}`);
    root.scale.multiplyScalar(metres);
    scene.add(root, new THREE.SkeletonHelper(root));
    const mixer = new THREE.AnimationMixer(root);
    const action = mixer.clipAction(clips[0]);
    action.setLoop(THREE.LoopOnce);
    action.clampWhenFinished = true;
    action.play();
    mixers.push(mixer);
    const before = people.length;
    root.traverse((node) => node.isBone && !node.parent?.isBone && people.push(node));
    counts.push(people.length - before);
  }
  return counts;
}

function pose(seconds) {
  for (const mixer of mixers) mixer.setTime(seconds);
  scene.updateMatrixWorld(true);
}

// For each person the places of the bones by name, metres, one list for each of these times.
function places(times) {
  const found = people.map(() => ({}));
  for (const seconds of times) {
    pose(seconds);
    people.forEach((hips, index) =>
      hips.traverse((bone) => {
        if (bone.isBone) (found[index][bone.name] ??= []).push(bone.getWorldPosition(new THREE.Vector3()).toArray());
      }),
    );
  }
  return found;
}

// Draws everybody at this time, and says what share of the picture is not stage.
function draw(seconds, label) {
  document.getElementById("label").textContent = label;
  pose(seconds);
  const camera = new THREE.PerspectiveCamera(40, innerWidth / innerHeight, 0.1, 100);
  const stand = people.map((hips) => hips.getWorldPosition(new THREE.Vector3()));
  const middle = stand.reduce((sum, at) => sum.add(at), new THREE.Vector3()).divideScalar(stand.length);
  // From where the first and the last person stand side by side.
  const across = stand[stand.length - 1].clone().sub(stand[0]).setY(0);
  const back = new THREE.Vector3(-across.z, 0, across.x).normalize();
  if (across.length() < 0.01) back.set(0, 0, 1);
  const away = 3 + 1.2 * across.length();
  camera.position.set(middle.x + away * back.x, 1.5, middle.z + away * back.z);
  camera.lookAt(middle.x, 0.85, middle.z);
  const hidden = scene.children.filter((child) => child.isGroup || child.type === "SkeletonHelper");
  const picture = () => {
    renderer.render(scene, camera);
    const gl = renderer.getContext();
    const pixels = new Uint8Array(gl.drawingBufferWidth * gl.drawingBufferHeight * 4);
    gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  };
  for (const thing of hidden) thing.visible = false;
  const stage = picture();
  for (const thing of hidden) thing.visible = true;
  const whole = picture();
  let changed = 0;
  for (let at = 0; at < whole.length; at += 4) changed += whole[at] !== stage[at] || whole[at + 1] !== stage[at + 1];
  return changed / (whole.length / 4);
}

window.reader = { load, places, draw };
