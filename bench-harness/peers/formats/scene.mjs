// The page that render.js opens: draws two models, the first of them twice, in the same light by the same camera, and says how far the pictures differ.
// Models stand as their files say, without animation.
import pixelmatch from 'pixelmatch';
import * as THREE from 'three';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { KTX2Loader } from 'three/addons/loaders/KTX2Loader.js';
import { MTLLoader } from 'three/addons/loaders/MTLLoader.js';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { read } from 'three/addons/libs/ktx-parse.module.js';
import { ZSTDDecoder } from 'three/addons/libs/zstddec.module.js';

const WIDTH = 1024;
const HEIGHT = 768;
// From where the camera looks.
const SIDES = { front: new THREE.Vector3(0.6, 0.4, 1), back: new THREE.Vector3(-0.6, 0.4, -1) };
// A picture with less is empty: the share of its pixels that show the model, and how many colours they have.
const LEAST_SHARE = 0.01;
const LEAST_COLOURS = 20;

const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(WIDTH, HEIGHT);
renderer.toneMapping = THREE.NeutralToneMapping;
renderer.domElement.addEventListener('webglcontextlost', () => fail('the graphics context was lost'));

// What a file shows, with all its textures.
async function load(address) {
  const manager = new THREE.LoadingManager();
  const missing = [];
  let isBusy = false;
  manager.onStart = () => (isBusy = true);
  manager.onLoad = () => (isBusy = false);
  manager.onError = (file) => missing.push(file);
  const model = await (address.endsWith('.obj') ? loadObj : loadGltf)(address, manager);
  while (isBusy) await new Promise((resolve) => setTimeout(resolve, 10));
  if (missing.length) throw new Error(`not loaded: ${missing.join(', ')}`);
  return model;
}

async function loadGltf(address, manager) {
  const textures = new TextureLoader(manager)
    .setTranscoderPath('/node_modules/three/examples/jsm/libs/basis/')
    .detectSupport(renderer);
  manager.addHandler(/\.ktx2$/, textures);
  return (await new GLTFLoader(manager).setKTX2Loader(textures).loadAsync(address)).scene;
}

// KTX 2, of three bytes a pixel too, which three's own loader refuses.
class TextureLoader extends KTX2Loader {
  parse(buffer, onLoad, onError) {
    const [VK_FORMAT_R8G8B8_UNORM, VK_FORMAT_R8G8B8_SRGB] = [23, 29];
    const container = read(new Uint8Array(buffer));
    const isOurs = [VK_FORMAT_R8G8B8_UNORM, VK_FORMAT_R8G8B8_SRGB].includes(container.vkFormat);
    return isOurs ? opaque(container).then(onLoad, onError) : super.parse(buffer, onLoad, onError);
  }
}

async function opaque({ levels, supercompressionScheme, pixelWidth, pixelHeight }) {
  const ZSTD = 2;
  const [{ levelData, uncompressedByteLength }] = levels;
  const decoder = new ZSTDDecoder();
  await decoder.init();
  const rgb = supercompressionScheme === ZSTD ? decoder.decode(levelData, uncompressedByteLength) : levelData;
  const rgba = new Uint8Array(4 * pixelWidth * pixelHeight).fill(255);
  for (let i = 0; i < pixelWidth * pixelHeight; i++) rgba.set(rgb.subarray(3 * i, 3 * i + 3), 4 * i);
  const texture = new THREE.DataTexture(rgba, pixelWidth, pixelHeight);
  Object.assign(texture, { generateMipmaps: true, needsUpdate: true });
  return texture;
}

async function loadObj(address, manager) {
  const text = await new THREE.FileLoader(manager).loadAsync(address);
  const loader = new OBJLoader(manager);
  const library = text.match(/^mtllib\s+(.*\S)/m);
  if (library) {
    const materials = await new MTLLoader(manager).loadAsync(new URL(library[1], address).href);
    materials.preload();
    loader.setMaterials(materials);
  }
  return loader.parse(text);
}

// All vertices of a model, where they are drawn.
function vertices(model) {
  model.updateMatrixWorld(true);
  const found = [];
  model.traverse((part) => {
    const count = part.isMesh ? part.geometry.attributes.position.count : 0;
    for (let i = 0; i < count; i++) found.push(part.getVertexPosition(i, new THREE.Vector3()).applyMatrix4(part.matrixWorld));
  });
  return found;
}

// Looks from a side at the middle of the points' box, from as near as shows all of them.
function cameraAt(side, points) {
  const camera = new THREE.PerspectiveCamera(35, WIDTH / HEIGHT);
  const centre = new THREE.Box3().setFromPoints(points).getCenter(new THREE.Vector3());
  camera.position.copy(centre).add(side);
  camera.lookAt(centre);
  const turn = camera.quaternion.clone().invert();
  const up = Math.tan(THREE.MathUtils.degToRad(camera.fov / 2));
  let [distance, radius] = [0, 0];
  for (const point of points) {
    const { x, y, z } = point.clone().sub(centre).applyQuaternion(turn);
    distance = Math.max(distance, 1.05 * (z + Math.max(Math.abs(y) / up, Math.abs(x) / (up * camera.aspect))));
    radius = Math.max(radius, 1.05 * Math.hypot(x, y, z));
  }
  camera.position.copy(centre).addScaledVector(side.clone().normalize(), distance);
  camera.near = Math.max(distance - radius, 0.01 * distance);
  camera.far = distance + radius;
  camera.updateProjectionMatrix();
  return camera;
}

const room = new THREE.PMREMGenerator(renderer).fromScene(new RoomEnvironment(), 0.04).texture;

// How a scene is lit: `day` shows the model's own materials in a bright room. `raking` shows its facets as of plaster, in lights that graze
// them: what is drawn by a program that passes over the file's normals, and where a change of positions shows most.
const LIGHTS = {
  day(scene, camera) {
    Object.assign(scene, { environment: room, environmentIntensity: 0.5 });
    scene.add(new THREE.HemisphereLight(0xffffff, 0x888888, 0.4), lightFrom(camera, new THREE.Vector3(1, 1.5, 2), 1.2));
  },
  raking(scene, camera) {
    scene.overrideMaterial = new THREE.MeshStandardMaterial({ flatShading: true, roughness: 0.7, side: THREE.DoubleSide });
    scene.add(lightFrom(camera, new THREE.Vector3(-1, 0.4, 0.3), 2.5), lightFrom(camera, new THREE.Vector3(1, -0.4, 0.3), 1));
  },
};

// Far away, in a direction as the camera sees it.
function lightFrom(camera, direction, intensity) {
  const light = new THREE.DirectionalLight(0xffffff, intensity);
  light.position.copy(direction.applyQuaternion(camera.quaternion));
  return light;
}

const canvas = new OffscreenCanvas(WIDTH, HEIGHT);
const context = canvas.getContext('2d', { willReadFrequently: true });
const pixels = () => context.getImageData(0, 0, WIDTH, HEIGHT).data;

// A picture as pixels, and as the address of a PNG.
function draw(scene, camera) {
  renderer.render(scene, camera);
  context.drawImage(renderer.domElement, 0, 0);
  return { data: pixels(), address: renderer.domElement.toDataURL() };
}

// The picture that was drawn last, as it comes out of a JPEG of a quality.
async function throughJpeg(quality) {
  const bitmap = await createImageBitmap(await canvas.convertToBlob({ type: 'image/jpeg', quality }));
  context.drawImage(bitmap, 0, 0);
  return { data: pixels() };
}

// Pixels of the pictures that are not background.
function shown(background, pictures) {
  const found = [];
  const differs = (at) => pictures.some(({ data }) => [0, 1, 2].some((c) => data[at + c] !== background[at + c]));
  for (let at = 0; at < background.length; at += 4) if (differs(at)) found.push(at);
  return found;
}

// Throws unless there is something in a picture.
function checkFilled({ data }, places) {
  const colours = new Set(places.map((at) => (data[at] << 16) | (data[at + 1] << 8) | data[at + 2]));
  if (places.length < LEAST_SHARE * WIDTH * HEIGHT || colours.size < LEAST_COLOURS) {
    throw new Error(`the picture is empty: ${places.length} pixels of ${colours.size} colours`);
  }
}

// How far pictures differ where they show the model. Of a pixel it is the channel that differs most that counts, of 255; `share` is pixelmatch's:
// pixels that look different, those of smoothed edges left out.
class Difference {
  counts = new Array(256).fill(0);
  shown = 0;
  different = 0;

  add(a, b, places) {
    for (const at of places) {
      this.counts[Math.max(...[0, 1, 2].map((c) => Math.abs(a.data[at + c] - b.data[at + c])))]++;
    }
    this.shown += places.length;
    this.different += pixelmatch(a.data, b.data, null, WIDTH, HEIGHT, { threshold: 0.1 });
  }

  figures() {
    const sum = this.counts.reduce((sum, count, size) => sum + count * size, 0);
    let [below, p999] = [this.counts[0], 0];
    while (below < 0.999 * this.shown) below += this.counts[++p999];
    return {
      mean: sum / this.shown,
      p999,
      max: this.counts.findLastIndex((count) => count > 0),
      share: this.different / this.shown,
    };
  }
}

// Both sides of the models in a light.
async function compare(lightName, models, pictures) {
  const differences = { again: new Difference(), signed: new Difference(), jpeg: new Difference() };
  for (const [sideName, side] of Object.entries(SIDES)) {
    const [scene, camera] = [new THREE.Scene(), cameraAt(side, models.points)];
    renderer.setClearColor(0xb0b8c0);
    LIGHTS[lightName](scene, camera);
    const drawWith = (model) => {
      scene.add(model);
      const picture = draw(scene, camera);
      scene.remove(model);
      return picture;
    };
    const background = draw(scene, camera).data;
    const [after, again, before] = [models.after, models.again, models.before].map(drawWith);
    const places = shown(background, [before, after]);
    checkFilled(before, places);
    differences.signed.add(before, after, places);
    differences.again.add(before, again, places);
    differences.jpeg.add(before, await throughJpeg(0.9), places);
    pictures[`${lightName}-${sideName}-before`] = before.address;
    pictures[`${lightName}-${sideName}-after`] = after.address;
  }
  return Object.fromEntries(Object.entries(differences).map(([name, difference]) => [name, difference.figures()]));
}

const wanted = new URL(location).searchParams;
const address = (which) => new URL(`/${which}/${encodeURIComponent(wanted.get(which))}`, location).href;
const models = {
  before: await load(address('before')),
  again: await load(address('before')),
  after: await load(address('after')),
};
models.points = vertices(models.before);
const [lights, pictures] = [{}, {}];
for (const light of Object.keys(LIGHTS)) lights[light] = await compare(light, models, pictures);
if (Object.values(lights).some(({ again }) => again.max > 0)) throw new Error('the same file, drawn twice, is not the same picture');
say({ lights, pictures });
