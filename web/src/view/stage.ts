import {
  Box3,
  Color,
  MathUtils,
  Mesh,
  MOUSE,
  MeshStandardMaterial,
  Object3D,
  OrthographicCamera,
  PCFShadowMap,
  PerspectiveCamera,
  Scene,
  Texture,
  TOUCH,
  Vector2,
  Vector3,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import type { Theme } from "../options";
import { Lights } from "./lights";
import { startDrawing, type Renderer } from "./renderer";
import { TILT, type Side } from "./sides";

/** Vertical field of view in degrees. */
const FIELD_OF_VIEW = 32;
/** Largest polar angle in rad: the camera can look from almost straight below. */
const LOWEST = MathUtils.degToRad(178);

export type Camera = PerspectiveCamera | OrthographicCamera;

/** Renderer, camera and lights. Draws only when something changed. */
export class Stage {
  readonly scene = new Scene();
  camera: Camera;
  readonly renderer: Renderer;
  readonly controls: OrbitControls;
  readonly isSoftware: boolean;
  /** Whether the browser can draw at all. Otherwise the page works without the view. */
  readonly draws: boolean;
  readonly hasShadows: boolean;
  /** Width and height of the view in CSS pixels, stored so that reading them causes no layout. */
  readonly size = new Vector2();
  frames = 0;
  /** Whether there is anything to draw. An empty frame would delay the first real one. */
  isReady = false;
  readonly lights: Lights;
  private readonly before: (() => void)[] = [];
  private readonly first: (() => void)[] = [];
  private readonly after: (() => void)[] = [];
  private pending = false;

  private readonly perspective = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 1000);
  private readonly orthographic = new OrthographicCamera(-1, 1, 1, -1, 0.01, 1000);

  constructor(private readonly holder: HTMLElement) {
    this.perspective.up.set(0, 0, 1);
    this.orthographic.up.set(0, 0, 1);
    this.camera = this.perspective;
    ({ renderer: this.renderer, isSoftware: this.isSoftware, draws: this.draws } = startDrawing());
    const shadows = new URLSearchParams(location.search).get("shadows");
    this.hasShadows = shadows === null ? !this.isSoftware : shadows === "on";
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.shadowMap.enabled = this.hasShadows;
    this.renderer.shadowMap.type = PCFShadowMap;
    const canvas = this.renderer.domElement;
    canvas.setAttribute(
      "aria-label",
      "3D view of the robot. Drag to rotate, scroll to zoom, drag with the right button to pan.",
    );
    canvas.setAttribute("role", "img");
    canvas.tabIndex = 0;
    holder.append(canvas);

    this.lights = new Lights(this.scene, this.hasShadows);

    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.controls.enableDamping = !this.isSoftware && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.controls.dampingFactor = 0.14;
    this.lockSide("");
    this.controls.addEventListener("change", () => this.invalidate());
    new ResizeObserver(() => this.resize()).observe(holder);
    onOtherScale(() => this.resize());
    this.resize();
  }

  /** Runs before each drawn frame. */
  onFrame(action: () => void): void {
    this.before.push(action);
  }

  /** Runs once, after the next drawn frame. */
  afterFrame(action: () => void): void {
    this.after.push(action);
  }

  /** Runs once after the first frame is on the screen, or at once if the browser cannot draw. */
  onFirstFrame(action: () => void): void {
    if (this.draws) this.first.push(action);
    else action();
  }

  /** Schedules a frame. The first one is drawn in a microtask, so that the page first appears with the robot. */
  invalidate(): void {
    if (this.pending || !this.isReady) return;
    this.pending = true;
    if (this.frames === 0) queueMicrotask(() => this.draw());
    else requestAnimationFrame(() => this.draw());
  }

  setTheme(theme: Theme): void {
    this.lights.setTheme(theme);
    this.invalidate();
  }

  setBackground(colour: number | string): void {
    this.scene.background = new Color(colour);
  }

  get isOrthographic(): boolean {
    return this.camera === this.orthographic;
  }

  /** Locks the view to a side. From the top it can rotate only about the vertical. From other sides a drag pans. */
  lockSide(side: Side | ""): void {
    const { controls } = this;
    const isTurned = side === "" || side === "top";
    controls.minPolarAngle = side === "top" ? TILT : 0;
    controls.maxPolarAngle = side === "top" ? TILT : LOWEST;
    controls.enableRotate = isTurned;
    controls.mouseButtons.LEFT = isTurned ? MOUSE.ROTATE : MOUSE.PAN;
    controls.touches.ONE = isTurned ? TOUCH.ROTATE : TOUCH.PAN;
  }

  /** The camera position. For an orthographic camera, the position at which perspective shows the same height. */
  get eye(): Vector3 {
    const { target } = this.controls;
    return this.camera.position.clone().sub(target).divideScalar(this.camera.zoom).add(target);
  }

  /** Switches the projection, and keeps the position and the visible height. */
  setOrthographic(on: boolean): void {
    if (on === this.isOrthographic) return;
    const other = on ? this.orthographic : this.perspective;
    other.position.copy(this.eye);
    other.quaternion.copy(this.camera.quaternion);
    this.camera = this.controls.object = other;
    this.orthographic.zoom = 1;
    this.fitCamera();
    this.controls.update();
    this.invalidate();
  }

  /** Height of the view at the target, in m. */
  get heightSeen(): number {
    const { top, bottom, zoom } = this.orthographic;
    if (this.isOrthographic) return (top - bottom) / zoom;
    return 2 * this.distance * Math.tan(MathUtils.degToRad(FIELD_OF_VIEW) / 2);
  }

  get distance(): number {
    return this.camera.position.distanceTo(this.controls.target);
  }

  /** Fits both cameras to the aspect ratio and the distance of the target. */
  private fitCamera(): void {
    const aspect = this.aspect;
    this.perspective.aspect = aspect;
    const half = this.distance * Math.tan(MathUtils.degToRad(FIELD_OF_VIEW) / 2);
    this.orthographic.top = half;
    this.orthographic.bottom = -half;
    this.orthographic.left = -half * aspect;
    this.orthographic.right = half * aspect;
    for (const camera of [this.perspective, this.orthographic]) {
      camera.near = camera === this.perspective ? this.distance / 100 : -this.distance * 20;
      camera.far = this.distance * 200;
      camera.updateProjectionMatrix();
    }
  }

  /** Looks at `centre` from an azimuth and elevation in degrees. */
  look(centre: Vector3, distance: number, azimuth: number, elevation: number): void {
    const a = MathUtils.degToRad(azimuth);
    const e = MathUtils.degToRad(elevation);
    this.camera.position.set(
      centre.x + distance * Math.cos(e) * Math.cos(a),
      centre.y + distance * Math.cos(e) * Math.sin(a),
      centre.z + distance * Math.sin(e),
    );
    this.lookAt(centre);
  }

  /** Looks at a box from an azimuth and elevation in degrees, so that it fills the view between insets in CSS pixels: top,
   * right, bottom, left. */
  lookAtBox(
    box: Box3,
    insets: readonly [number, number, number, number],
    azimuth: number,
    elevation: number,
  ): void {
    const centre = box.getCenter(new Vector3());
    this.look(centre, 1, azimuth, elevation);
    const [right, up, back] = [new Vector3(), new Vector3(), new Vector3()];
    this.camera.updateMatrixWorld();
    this.camera.matrixWorld.extractBasis(right, up, back);
    const [top, east, bottom, west] = insets;
    const perPixel = (2 * Math.tan(MathUtils.degToRad(FIELD_OF_VIEW) / 2)) / Math.max(1, this.size.y);
    const wide = (perPixel * (this.size.x - west - east)) / 2;
    const high = (perPixel * (this.size.y - top - bottom)) / 2;
    let distance = 0;
    for (const x of [box.min.x, box.max.x])
      for (const y of [box.min.y, box.max.y])
        for (const z of [box.min.z, box.max.z]) {
          const corner = new Vector3(x, y, z).sub(centre);
          const aside = Math.max(Math.abs(corner.dot(up)) / high, Math.abs(corner.dot(right)) / wide);
          distance = Math.max(distance, corner.dot(back) + aside);
        }
    const shift = (perPixel * distance) / 2; // of the target, so that the box is in the middle between the insets
    centre.addScaledVector(right, (east - west) * shift).addScaledVector(up, (top - bottom) * shift);
    this.look(centre, distance, azimuth, elevation);
  }

  /** Looks at a point from the current camera position. */
  lookAt(target: Vector3): void {
    this.controls.target.copy(target);
    this.orthographic.zoom = 1;
    this.fitCamera();
    this.controls.update();
    this.invalidate();
  }

  /** Draws the view of another camera onto a canvas, up to the size of the view. The frame itself is drawn afterwards. */
  drawAs(eye: PerspectiveCamera, onto: CanvasRenderingContext2D, behind: Texture | null): void {
    const { renderer, scene } = this;
    const { domElement: whole } = renderer;
    const { width, height } = onto.canvas;
    const scale = Math.min(1, whole.width / width, whole.height / height);
    const [wide, high] = [Math.round(width * scale), Math.round(height * scale)];
    const ratio = renderer.getPixelRatio();
    const { background } = scene;
    scene.background = behind ?? background;
    renderer.setViewport(0, 0, wide / ratio, high / ratio);
    renderer.render(scene, eye);
    renderer.setViewport(0, 0, this.size.x, this.size.y);
    scene.background = background;
    onto.drawImage(whole, 0, whole.height - high, wide, high, 0, 0, width, height);
  }

  /** The distance from which a sphere fills most of the view. */
  distanceFor(radius: number): number {
    const half = MathUtils.degToRad(FIELD_OF_VIEW) / 2;
    const narrow = Math.min(1, this.aspect);
    return (radius * 1.35) / Math.sin(half) / narrow;
  }

  private draw(): void {
    this.pending = false;
    const { near } = this.perspective;
    if (!this.isOrthographic && (this.distance < near * 20 || this.distance > near * 500)) this.fitCamera();
    this.controls.update();
    for (const action of this.before) action();
    if (this.frames === 0 && this.draws) this.drawFirst();
    else this.renderer.render(this.scene, this.camera);
    this.frames += 1;
    for (const action of this.after.splice(0)) action();
  }

  /** Draws only solid objects. The programs of other materials are compiled for the next frame, so this one is faster. */
  private drawFirst(): void {
    const others: Object3D[] = [];
    this.scene.traverseVisible((object) => {
      const { material } = object as Partial<Mesh>;
      if (material !== undefined && !(material instanceof MeshStandardMaterial)) others.push(object);
    });
    for (const object of others) object.visible = false;
    this.renderer.render(this.scene, this.camera);
    for (const object of others) object.visible = true;
    whenSeen(() => {
      this.invalidate();
      for (const action of this.first.splice(0)) action();
    });
  }

  /** Device pixels per CSS pixel, up to 2. In software rendering it is 1, because four times the pixels are too slow. */
  private get ratio(): number {
    return this.isSoftware ? 1 : Math.min(devicePixelRatio, 2);
  }

  private get aspect(): number {
    return this.size.x / Math.max(1, this.size.y) || 1;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.holder;
    const { x, y } = this.size;
    const { ratio } = this;
    const isSharp = ratio === this.renderer.getPixelRatio();
    if (width === 0 || height === 0 || (width === x && height === y && isSharp)) return; // a new size would allocate a new buffer
    if (!isSharp) this.renderer.setPixelRatio(ratio);
    this.size.set(width, height);
    const { zoom } = this.orthographic;
    this.fitCamera();
    this.orthographic.zoom = zoom;
    this.orthographic.updateProjectionMatrix();
    this.renderer.setSize(width, height);
    this.invalidate();
  }
}

/** Calls back when the device pixel ratio changes, by zoom or by another screen. */
function onOtherScale(action: () => void): void {
  const changed = (): void => {
    action();
    onOtherScale(action);
  };
  matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", changed, { once: true });
}

/** Calls back once the browser has painted the page for the first time. */
function whenSeen(action: () => void): void {
  const observer = new PerformanceObserver((painted) => {
    if (painted.getEntriesByName("first-contentful-paint").length === 0) return;
    observer.disconnect();
    action();
  });
  observer.observe({ type: "paint", buffered: true });
}
