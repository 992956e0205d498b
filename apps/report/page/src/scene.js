// The 3D view: six things to draw at most, whatever the number of patches.
import {
  BufferAttribute, BufferGeometry, ColorManagement, DirectionalLight, DoubleSide,
  HemisphereLight, InstancedMesh, LineBasicMaterial, LineSegments,
  LinearSRGBColorSpace, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, Points,
  PointsMaterial, Raycaster, Scene, SphereGeometry, Vector2, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { firstView } from './camera.js';
import { parseHex, soleColors } from './colors.js';
import { cssColor } from './dom.js';
import { centreEllipsoid, normalEllipsoid, visibleMagnification } from './ellipsoids.js';
import { median } from './linear.js';
import { Lines, mergedPatches, mergedSoles, patchOfVertex, visibleIndex } from './geometry.js';

const kManyPatches = 800; // from here on ellipsoids are coarser

// Colours are those of the screen from end to end.
ColorManagement.enabled = false;

function pointColors({ positions, colors, colored }) {
  if (colored) return new BufferAttribute(colors, 3, true);
  const rgb = new Uint8Array(positions.length);
  for (let i = 0; i < colors.length; ++i) {
    rgb[3 * i] = colors[i];
    rgb[3 * i + 1] = 0.98 * colors[i];
    rgb[3 * i + 2] = 0.94 * colors[i];
  }
  return new BufferAttribute(rgb, 3, true);
}

// Of half a patch's size: how far apart things that lie on each other are kept.
const kStandOff = 0.6;

// Moves what it draws away from the eye, or nearer, without changing where it appears:
// points of the same surface do not cover patches, nor patches what lies on them.
function standOff(material, factor) {
  material.onBeforeCompile = (shader) => {
    shader.uniforms.standOff = { value: factor };
    shader.vertexShader = `uniform float standOff;\n${shader.vertexShader}`.replace(
      '#include <project_vertex>',
      `#include <project_vertex>
       mvPosition.xyz *= standOff;
       gl_Position = projectionMatrix * mvPosition;`,
    );
  };
  return material;
}

function instances(geometry, count, nearer) {
  const material = new MeshLambertMaterial({ transparent: true, opacity: 0.85 });
  const mesh = new InstancedMesh(geometry, standOff(material, nearer), Math.max(1, count));
  mesh.frustumCulled = false;
  mesh.count = 0;
  return mesh;
}

export class View {
  // onPick(patch or null)
  // \throw where there is no WebGL.
  constructor(canvas, { onPick }) {
    this.canvas = canvas;
    this.onPick = onPick;
    // Asked before three.js does, which would complain to the console.
    const context = canvas.getContext('webgl2', { antialias: true, alpha: true });
    if (!context) throw new Error('no WebGL');
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.camera = new PerspectiveCamera();
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.listenToKeyEvents(canvas);
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.redraw());
    this.listenToClicks();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.recolor());
  }

  // \param options { sigmas, cloud, patches, soles, frames, centres, normals }
  show(result, options) {
    this.result = result;
    this.options = { ...options };
    this.scene?.traverse((object) => {
      object.geometry?.dispose();
      object.material?.dispose();
    });
    this.scene = new Scene();
    this.patches = mergedPatches(result);
    this.visible = new Array(result.count).fill(true);
    this.selected = null;
    this.addLights();
    this.placeCamera();
    this.addCloud();
    this.addPatches();
    this.addSoles();
    this.addLines();
    this.addEllipsoids();
  }

  addLights() {
    this.scene.add(new HemisphereLight(0xffffff, 0xb0aaa0, 2.0));
    const lamp = new DirectionalLight(0xffffff, 1.6);
    lamp.position.set(-0.5, 0.75, 0.75);
    this.camera.clear();
    this.camera.add(lamp, lamp.target);
    this.scene.add(this.camera);
  }

  placeCamera() {
    const { view, cloud } = this.result;
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    const positions = cloud.positions?.length ? cloud.positions : this.patches.positions;
    this.first = firstView(view, positions, clientWidth / clientHeight);
    const size = median(this.result.meshes.reach.filter((reach) => reach > 0));
    this.lift = Math.min(0.05, (kStandOff * (size || 0)) / this.first.depth);
    this.resetCamera();
  }

  resetCamera() {
    const { eye, target, fov, depth } = this.first;
    this.camera.up.set(...this.result.view.up);
    this.camera.position.set(...eye);
    this.camera.fov = fov;
    this.camera.near = depth / 200;
    this.camera.far = depth * 50;
    this.controls.target.set(...target);
    this.resize();
    this.controls.update();
  }

  // Where the patches are, in the first view.
  pixelsPerMetre() {
    const half = Math.tan((this.first.fov * Math.PI) / 360);
    return this.canvas.parentElement.clientHeight / (2 * half * this.first.depth);
  }

  addCloud() {
    const { cloud } = this.result;
    this.cloud = null;
    if (!cloud.positions?.length) return;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(cloud.positions, 3));
    geometry.setAttribute('color', pointColors(cloud));
    // three.js leaves the field of view out of the size of points.
    const size = (1.15 * cloud.spacing) / Math.tan((this.first.fov * Math.PI) / 360);
    const material = new PointsMaterial({ size, vertexColors: true });
    this.cloud = new Points(geometry, standOff(material, 1 + this.lift));
    this.scene.add(this.cloud);
  }

  addPatches() {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(this.patches.positions, 3));
    geometry.setIndex(new BufferAttribute(this.patches.index, 1));
    geometry.computeVertexNormals();
    const colors = new BufferAttribute(new Float32Array(this.patches.positions.length), 3);
    geometry.setAttribute('color', colors);
    const material = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide });
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
    this.scene.add(this.mesh);
  }

  // Plates in the colour of their risk, whatever the patches show.
  addSoles() {
    this.soles = null;
    if (!this.result.risk?.count) return;
    this.soles = mergedSoles(this.result.risk, soleColors(this.result));
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(this.soles.positions, 3));
    geometry.setAttribute('color', new BufferAttribute(this.soles.colors.slice(), 3));
    const material = new MeshBasicMaterial({ vertexColors: true, side: DoubleSide });
    this.soleMesh = new Mesh(geometry, standOff(material, 1 - 0.5 * this.lift));
    this.soleMesh.frustumCulled = false;
    this.scene.add(this.soleMesh);
  }

  addLines() {
    const material = standOff(new LineBasicMaterial({ vertexColors: true }), 1 - 0.1 * this.lift);
    this.lines = new LineSegments(new BufferGeometry(), material);
    this.lines.frustumCulled = false;
    this.scene.add(this.lines);
  }

  addEllipsoids() {
    const { count, meshes } = this.result;
    const patches = Array.from({ length: count }, (_, i) => i);
    this.centres = patches.map((i) => centreEllipsoid(this.result, i));
    this.normals = patches.map((i) => normalEllipsoid(this.result, i, meshes.reach[i]));
    const sphere = count > kManyPatches ? new SphereGeometry(1, 10, 6) : new SphereGeometry(1, 20, 12);
    this.centreMesh = instances(sphere, count, 1 - 0.5 * this.lift);
    this.normalMesh = instances(sphere, count, 1 - 0.5 * this.lift);
    this.scene.add(this.centreMesh, this.normalMesh);
    this.options.magnification = visibleMagnification(
      this.centres, this.first.eye, this.options.sigmas, this.pixelsPerMetre(),
    );
  }

  set(options) {
    Object.assign(this.options, options);
    this.update();
  }

  setVisible(visible) {
    this.visible = visible;
    this.update();
  }

  setColoring(coloring) {
    this.coloring = coloring;
    this.recolor();
  }

  select(i) {
    this.selected = i;
    this.recolor();
  }

  recolor() {
    if (!this.coloring) return;
    const ink = parseHex(cssColor('--ink'));
    const { array } = this.mesh.geometry.attributes.color;
    const { vertexStarts } = this.patches;
    for (let i = 0; i < this.result.count; ++i) {
      const color = i === this.selected ? ink : this.coloring.color(i);
      for (let v = vertexStarts[i]; v < vertexStarts[i + 1]; ++v) array.set(color, 3 * v);
    }
    this.mesh.geometry.attributes.color.needsUpdate = true;
    this.recolorSoles(ink);
    this.centreMesh.material.color.setRGB(...parseHex(cssColor('--centre')));
    this.normalMesh.material.color.setRGB(...parseHex(cssColor('--normal')));
    this.update();
  }

  // That on the selected patch is as the patch, which it covers.
  recolorSoles(ink) {
    if (!this.soles) return;
    const { array } = this.soleMesh.geometry.attributes.color;
    array.set(this.soles.colors);
    const size = array.length / 3 / this.soles.starts.length;
    this.soles.starts.forEach((first, k) => {
      if (this.result.risk.patchOf(k) !== this.selected) return;
      for (let v = first; v < first + size; ++v) array.set(ink, 3 * v);
    });
    this.soleMesh.geometry.attributes.color.needsUpdate = true;
  }

  // All changes until the next picture are worked off together.
  update() {
    this.isStale = true;
    this.redraw();
  }

  refresh() {
    this.isStale = false;
    const { cloud, patches, centres, normals } = this.options;
    if (this.cloud) this.cloud.visible = cloud;
    this.mesh.visible = patches;
    this.mesh.geometry.setIndex(new BufferAttribute(visibleIndex(this.patches, this.visible), 1));
    this.updateSoles();
    this.updateLines();
    this.updateInstances(this.centreMesh, centres ? this.centres : []);
    this.updateInstances(this.normalMesh, normals ? this.normals : []);
  }

  // Those of visible patches.
  shownFootholds() {
    const { risk } = this.result;
    if (!this.soles || !this.options.soles) return [];
    return this.soles.starts.flatMap((_, k) => (this.visible[risk.patchOf(k)] ? [k] : []));
  }

  updateSoles() {
    if (!this.soles) return;
    const index = this.shownFootholds().flatMap((k) => this.soles.triangles(k));
    this.soleMesh.geometry.setIndex(index);
    this.soleMesh.visible = index.length > 0;
  }

  updateLines() {
    const { frames, normals, patches } = this.options;
    const { meshes, view } = this.result;
    const lines = new Lines();
    const accent = parseHex(cssColor('--accent'));
    const normalColor = parseHex(cssColor('--normal'));
    this.visible.forEach((isVisible, i) => {
      if (!isVisible || !this.result.hasShape(i)) return;
      const dark = this.coloring.color(i).map((x) => 0.55 * x);
      if (patches) lines.addOutline(this.patches, meshes, i, i === this.selected ? accent : dark);
      if (frames) lines.addFrame(this.result.centreOf(i), this.result.axesOf(i), 0.5 * meshes.reach[i]);
      if (normals && this.normals[i]) lines.add(this.result.centreOf(i), this.normals[i].centre, normalColor);
    });
    this.shownFootholds().forEach((k) => {
      const isSelected = this.result.risk.patchOf(k) === this.selected;
      lines.addSole(this.result.risk.soles[k], isSelected ? accent : [0.08, 0.08, 0.08]);
    });
    if (frames && view.seen) this.addSensorFrame(lines, view);
    const { geometry } = this.lines;
    geometry.dispose();
    geometry.setAttribute('position', new BufferAttribute(new Float32Array(lines.positions), 3));
    geometry.setAttribute('color', new BufferAttribute(new Float32Array(lines.colors), 3));
    this.lines.visible = lines.positions.length > 0;
  }

  addSensorFrame(lines, { eye, forward, right }) {
    const z = new Vector3(...forward);
    const down = z.clone().cross(new Vector3(...right)).toArray();
    lines.addFrame(eye, [right, down, forward], 0.1 * this.first.depth);
  }

  updateInstances(mesh, ellipsoids) {
    const factor = this.options.sigmas * this.options.magnification;
    const matrix = new Matrix4();
    const [x, y, z] = [new Vector3(), new Vector3(), new Vector3()];
    const least = 1e-6 * this.first.depth; // a sphere squeezed to nothing has no normals
    let count = 0;
    ellipsoids.forEach((ellipsoid, i) => {
      if (!ellipsoid || !this.visible[i]) return;
      [x, y, z].forEach((axis, k) => {
        axis.set(...ellipsoid.columns[k]).multiplyScalar(factor);
        if (axis.length() < least) axis.setLength(least);
      });
      matrix.makeBasis(x, y, z).setPosition(...ellipsoid.centre);
      mesh.setMatrixAt(count++, matrix);
    });
    mesh.count = count;
    mesh.visible = count > 0;
    mesh.instanceMatrix.needsUpdate = true;
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.redraw();
  }

  // Once before the next picture of the screen, however often it is asked for.
  redraw() {
    if (this.isAskedFor) return;
    this.isAskedFor = true;
    requestAnimationFrame(() => {
      this.isAskedFor = false;
      if (this.isStale && this.coloring) this.refresh();
      if (this.scene) this.renderer.render(this.scene, this.camera);
    });
  }

  // A click, in contrast to the end of a drag.
  listenToClicks() {
    let down = null;
    this.canvas.addEventListener('pointerdown', (event) => {
      down = [event.clientX, event.clientY];
    });
    this.canvas.addEventListener('pointerup', (event) => {
      if (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 5)
        this.onPick(this.patchAt(event.clientX, event.clientY));
      down = null;
    });
  }

  patchAt(clientX, clientY) {
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector2(
      (2 * (clientX - box.left)) / box.width - 1,
      1 - (2 * (clientY - box.top)) / box.height,
    );
    const caster = new Raycaster();
    caster.setFromCamera(at, this.camera);
    const [hit] = this.mesh.visible ? caster.intersectObject(this.mesh) : [];
    return hit ? patchOfVertex(this.patches.vertexStarts, hit.face.a) : null;
  }

  // Of the middle of a patch, px from the top left corner of the window.
  pixelOf(i) {
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector3(...this.result.centreOf(i)).project(this.camera);
    return [box.left + ((at.x + 1) / 2) * box.width, box.top + ((1 - at.y) / 2) * box.height];
  }
}
