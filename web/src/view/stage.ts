import {
  Color,
  DirectionalLight,
  HemisphereLight,
  MathUtils,
  PCFShadowMap,
  PerspectiveCamera,
  Scene,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import type { Theme } from "../options";
import { PALETTES } from "./palette";

const FIELD_OF_VIEW = 32;

/** Renderer, camera and lights. Draws only when something changed. */
export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 1000);
  readonly renderer: WebGLRenderer;
  readonly controls: OrbitControls;
  readonly isSoftware: boolean;
  readonly hasShadows: boolean;
  frames = 0;
  private readonly sky = new HemisphereLight(0xffffff, 0x666666, 1.5);
  private readonly sun = new DirectionalLight(0xffffff, 2.1);
  private readonly fill = new DirectionalLight(0xffffff, 0.5);
  private readonly before: (() => void)[] = [];
  private pending = false;

  constructor(private readonly holder: HTMLElement) {
    this.camera.up.set(0, 0, 1);
    this.renderer = new WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.isSoftware = isSoftware(this.renderer);
    const asked = new URLSearchParams(location.search).get("shadows");
    this.hasShadows = asked === null ? !this.isSoftware : asked === "on";
    this.renderer.setPixelRatio(this.isSoftware ? 1 : Math.min(devicePixelRatio, 2));
    this.renderer.shadowMap.enabled = this.hasShadows;
    this.renderer.shadowMap.type = PCFShadowMap;
    const canvas = this.renderer.domElement;
    canvas.setAttribute("aria-label", "The robot. Drag to turn the view, scroll to come closer, drag with the right button to move it.");
    canvas.setAttribute("role", "img");
    canvas.tabIndex = 0;
    holder.append(canvas);

    this.sun.castShadow = this.hasShadows;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.radius = 4;
    this.sun.shadow.bias = -0.0004;
    this.fill.position.set(-2, -1, 0.6);
    this.scene.add(this.sky, this.sun, this.sun.target, this.fill);

    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.zoomToCursor = true;
    this.controls.enableDamping = !this.isSoftware && !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.controls.dampingFactor = 0.14;
    this.controls.maxPolarAngle = MathUtils.degToRad(178);
    this.controls.addEventListener("change", () => this.invalidate());
    new ResizeObserver(() => this.resize()).observe(holder);
    this.resize();
  }

  /** Runs before each drawn frame. */
  onFrame(action: () => void): void {
    this.before.push(action);
  }

  /** Something changed: draw at the next chance. */
  invalidate(): void {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => this.draw());
  }

  setTheme(theme: Theme): void {
    const palette = PALETTES[theme];
    this.scene.background = new Color(palette.background);
    this.sky.color.set(palette.sky);
    this.sky.groundColor.set(palette.ground);
    this.invalidate();
  }

  /** Puts sun and shadow around a place. */
  lightAround(centre: Vector3, radius: number): void {
    this.sun.target.position.copy(centre);
    this.sun.position.set(centre.x + radius * 1.6, centre.y - radius * 2.2, centre.z + radius * 4.5);
    const shadow = this.sun.shadow.camera;
    shadow.left = shadow.bottom = -radius * 2.2;
    shadow.right = shadow.top = radius * 2.2;
    shadow.near = radius;
    shadow.far = radius * 12;
    shadow.updateProjectionMatrix();
    this.sun.shadow.normalBias = radius * 0.004;
  }

  /** Looks at `centre` from a direction given by azimuth and elevation in degrees. */
  look(centre: Vector3, distance: number, azimuth: number, elevation: number): void {
    const a = MathUtils.degToRad(azimuth);
    const e = MathUtils.degToRad(elevation);
    this.camera.position.set(
      centre.x + distance * Math.cos(e) * Math.cos(a),
      centre.y + distance * Math.cos(e) * Math.sin(a),
      centre.z + distance * Math.sin(e),
    );
    this.controls.target.copy(centre);
    this.camera.near = distance / 100;
    this.camera.far = distance * 200;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.invalidate();
  }

  /** The distance from which a sphere fills most of the picture. */
  distanceFor(radius: number): number {
    const half = MathUtils.degToRad(FIELD_OF_VIEW) / 2;
    const narrow = Math.min(1, this.camera.aspect);
    return (radius * 1.35) / Math.sin(half) / narrow;
  }

  private draw(): void {
    this.pending = false;
    const distance = this.camera.position.distanceTo(this.controls.target);
    if (distance < this.camera.near * 20 || distance > this.camera.near * 500) {
      this.camera.near = distance / 100;
      this.camera.far = distance * 200;
      this.camera.updateProjectionMatrix();
    }
    this.controls.update();
    for (const action of this.before) action();
    this.renderer.render(this.scene, this.camera);
    this.frames += 1;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.holder;
    if (width === 0 || height === 0) return;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.setSize(width, height);
    this.invalidate();
  }
}

function isSoftware(renderer: WebGLRenderer): boolean {
  const gl = renderer.getContext();
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}
