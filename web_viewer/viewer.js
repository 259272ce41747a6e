// The script of the page that --export web writes: shows a GLB of RefMesh, and plays it frame by frame.
import { AnimationMixer, Box3, Color, DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, Sphere, Timer, Vector3, WebGLRenderer } from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { Playback } from './playback.js';
import { Statistics } from './statistics.js';
import { loadBytes } from './take.js';

const BACKGROUND = 0x23272c;
const FIELD_OF_VIEW = 35; // degrees
const MARGIN = 1.02; // of the distance from which the whole take is visible

class Viewer {
  constructor(canvas, take, gltf) {
    this.take = take;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(window.devicePixelRatio);
    this.scene = new Scene();
    this.scene.background = new Color(BACKGROUND);
    this.scene.add(gltf.scene, new HemisphereLight(0xffffff, 0x33333c, 1.0));
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 1000);
    const light = new DirectionalLight(0xffffff, 1.8);
    light.position.set(-1, 1.2, 1);
    this.camera.add(light); // shines over the viewer's shoulder
    this.scene.add(this.camera);
    this.controls = new OrbitControls(this.camera, canvas);
    this.mixer = new AnimationMixer(gltf.scene);
    this.action = gltf.animations.length ? this.mixer.clipAction(gltf.animations[0]) : null;
    if (this.action) {
      this.action.play();
      this.action.paused = true; // the time is always set, never advanced by the mixer
    }
    this.model = gltf.scene;
    this.meshes = [];
    gltf.scene.traverse((node) => {
      if (!node.isMesh) return;
      node.frustumCulled = false; // bounds are those of the base mesh, not of its morph targets
      this.meshes.push(node);
    });
    this.show(take.first);
    this.frameTake();
  }

  // Shows a frame by its number.
  show(number) {
    if (this.action) {
      this.action.time = (number - this.take.first) / this.take.frameRate;
      this.mixer.update(0);
    }
    this.model.updateMatrixWorld(true);
    for (const mesh of this.meshes) mesh.visible = mesh.parent.scale.x > 0.5;
  }

  shownMeshes() {
    return this.meshes.filter((mesh) => mesh.visible);
  }

  // World positions of all vertices that are shown, as three.js computes them: x, y, z of one after another.
  positions() {
    const result = [], point = new Vector3();
    for (const mesh of this.shownMeshes()) {
      const count = mesh.geometry.attributes.position.count;
      for (let index = 0; index < count; index++) {
        mesh.getVertexPosition(index, point).applyMatrix4(mesh.matrixWorld);
        result.push(point.x, point.y, point.z);
      }
    }
    return result;
  }

  setWireframe(on) {
    for (const mesh of this.meshes) mesh.material.wireframe = on;
  }

  // Moves the camera so that the frame that is shown fits into the picture.
  frameTake() {
    const box = new Box3(), point = new Vector3(), values = this.positions();
    for (let index = 0; index < values.length; index += 3) box.expandByPoint(point.fromArray(values, index));
    const sphere = box.getBoundingSphere(new Sphere());
    const distance = (MARGIN * sphere.radius) / Math.sin((FIELD_OF_VIEW * Math.PI) / 360);
    this.camera.near = distance / 100;
    this.camera.far = distance * 100;
    this.camera.position.copy(sphere.center).add(new Vector3(0, 0, distance));
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(sphere.center);
    this.controls.update();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  render() {
    this.renderer.render(this.scene, this.camera);
  }
}

function tell(message) {
  const place = document.getElementById('message');
  place.textContent = message;
  place.hidden = !message;
}

function connect(viewer, playback, statistics) {
  const element = (id) => document.getElementById(id);
  const slider = element('frame'), button = element('play'), wireframe = element('wireframe'), panel = element('statistics');
  slider.min = playback.first;
  slider.max = playback.last;
  playback.onChange = () => {
    slider.value = playback.frame;
    button.textContent = playback.playing ? 'Pause' : 'Play';
    element('number').textContent = `Frame ${playback.frame}`;
    viewer.show(playback.frame);
  };
  slider.addEventListener('input', () => playback.seek(Number(slider.value)));
  button.addEventListener('click', () => playback.toggle());
  element('speed').addEventListener('change', (event) => (playback.speed = Number(event.target.value)));
  wireframe.addEventListener('change', () => viewer.setWireframe(wireframe.checked));
  element('show-statistics').addEventListener('change', (event) => (panel.hidden = !event.target.checked));
  element('reset').addEventListener('click', () => viewer.frameTake());
  window.addEventListener('keydown', (event) => {
    if (event.target.matches('select, input[type=range]') || event.ctrlKey || event.metaKey || event.altKey) return;
    const actions = {
      ' ': () => playback.toggle(),
      ArrowRight: () => playback.seek(playback.frame + 1),
      ArrowLeft: () => playback.seek(playback.frame - 1),
      w: () => wireframe.click(),
      Home: () => viewer.frameTake(),
    };
    const action = event.target.matches('button') && event.key === ' ' ? undefined : actions[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
  const timer = new Timer();
  viewer.renderer.setAnimationLoop(() => {
    timer.update();
    playback.advance(timer.getDelta());
    viewer.controls.update();
    viewer.render();
    statistics.count(timer.getDelta(), viewer);
  });
}

async function start() {
  const take = JSON.parse(document.getElementById('take').textContent);
  const bytes = await loadBytes(take.file);
  const gltf = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(bytes, '');
  const viewer = new Viewer(document.getElementById('canvas'), take, gltf);
  const playback = new Playback(take.first, take.last, take.frameRate);
  connect(viewer, playback, new Statistics(document.getElementById('statistics'), take));
  new ResizeObserver(() => viewer.resize()).observe(document.getElementById('canvas'));
  viewer.resize();
  playback.seek(take.first);
  window.refmesh = { viewer, playback, ready: true };
  tell('');
  if (take.last > take.first && !new URLSearchParams(window.location.search).has('paused')) playback.toggle();
}

start().catch((error) => {
  window.refmesh = { error: String(error) };
  tell(`The capture cannot be shown: ${error.message || error}`);
});
