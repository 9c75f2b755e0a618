import { Group, Matrix4, Object3D, PerspectiveCamera, Texture, Vector2, Vector3 } from "three";

import type { App } from "../app";
import type { Picture } from "../displays/display";
import { LiveDisplays } from "../displays/live";
import { h } from "../dom";
import type { Scene, State } from "../protocol";
import { Bodies } from "./bodies";
import { dispose } from "./dispose";
import { Ground } from "./ground";
import { IdBuffer } from "./ids";
import { Viewpoint } from "./viewpoint";
import { PALETTES } from "./palette";
import { takePicture, type Wanted } from "./picture";
import { RobotObject } from "./robot";
import { forgetPrimitives } from "./shapes";
import { Stage } from "./stage";
import { looksTheSame } from "./still";
import { Transforms } from "./transforms";

/** The 3D view: the robot in its world, the displays and the camera. */
export class View implements Picture {
  readonly stage: Stage;
  readonly ids: IdBuffer;
  robot: RobotObject | null = null;
  bodies: Bodies | null = null;
  readonly ground = new Ground();
  readonly overlay: HTMLElement;
  /** Objects that the tools draw in the world. */
  readonly marks = new Group();
  readonly transforms: Transforms;
  readonly viewpoint: Viewpoint;
  private readonly displays: LiveDisplays;
  /** Everything in world coordinates. */
  private readonly world = new Group();
  /** The replaced robot, until the current one is drawn. */
  private removedRobot: Object3D | null = null;
  /** The last position of the followed frame, and its name. */
  private readonly lastSeen = new Vector3();
  private lastFrame = "";
  private placed = false;
  /** The bodies whose contact shadows are drawn, null if they must be computed again. */
  private castsFrom: Bodies | null = null;
  /** The world that the camera framed, and whether it must frame another one. */
  private framedWorld = "";
  private reframes = false;
  /** The state in the last frame, null if it must be drawn again. */
  private drawn: State | null = null;
  /** The last projection and camera mode. */
  private kind = "";

  constructor(
    readonly app: App,
    private readonly holder: HTMLElement,
  ) {
    this.stage = new Stage(holder);
    this.overlay = h("div", { class: "overlay" });
    holder.append(this.overlay);
    this.ids = new IdBuffer(this.stage.renderer);
    this.transforms = new Transforms(app);
    this.displays = new LiveDisplays(app, this);
    this.world.add(this.ground.floor, this.ground.contacts.group, this.displays.group, this.marks);
    if (this.stage.hasShadows) {
      this.world.add(this.ground.shadow);
      this.ground.contactShare = 0.5; // beside an object, the sun's shadow darkens the floor too
    }
    this.world.matrixAutoUpdate = false;
    this.stage.scene.add(this.world);
    this.stage.onFrame(() => this.beforeFrame());
    this.watchContext();
    this.viewpoint = new Viewpoint(app, this.stage, this);
    app.scene.watch((scene) => scene && this.build(scene));
    app.state.watch((state) => state && this.apply(state));
    app.options.watch(() => this.showOptions());
    app.theme.watch(() => this.paint());
    app.displays.globals.watch(() => this.showGlobals());
    app.requestedView.watch((view) => view !== null && this.placed && this.viewpoint.applyFile(view));
    app.selected.watch((name) => this.robot?.select(name));
  }

  private watchContext(): void {
    const { rendering } = this.app;
    const { draws, renderer } = this.stage;
    if (!draws) rendering.set("never");
    renderer.domElement.addEventListener("webglcontextlost", () => rendering.set("lost"));
    renderer.domElement.addEventListener("webglcontextrestored", () => {
      rendering.set("drawn");
      this.stage.invalidate();
    });
  }

  /** Name of the link at a point of the view, in CSS pixels from its top left. Empty for none. */
  linkAt(x: number, y: number): string {
    const { clientWidth, clientHeight } = this.holder;
    const id = this.ids.at(this.stage.camera, x, y, clientWidth, clientHeight);
    return this.app.scene.value?.links[id]?.name ?? "";
  }

  get radius(): number {
    return this.app.scene.value?.radius ?? 0.1;
  }

  get fixedFrame(): string {
    const requested = String(this.app.displays.global("frame"));
    return requested !== "" && this.transforms.lookup(requested, null) !== null
      ? requested
      : this.transforms.world;
  }

  onScreen(point: Vector3): Vector2 {
    const { camera, size } = this.stage;
    const { x, y } = point.clone().applyMatrix4(this.world.matrix).project(camera);
    return new Vector2(((x + 1) / 2) * size.x, ((1 - y) / 2) * size.y);
  }

  invalidate(): void {
    this.stage.invalidate();
  }

  drawAs(
    eye: PerspectiveCamera,
    onto: CanvasRenderingContext2D,
    behind: Texture | null,
    isSeen: (display: string) => boolean,
  ): void {
    const floor = behind === null ? [] : [this.ground.floor, this.ground.contacts.group]; // the image behind shows the floor
    const hidden = [...floor, ...this.displays.objects((name) => !isSeen(name))].filter(
      (object) => object.visible,
    );
    for (const object of hidden) object.visible = false;
    this.stage.drawAs(eye, onto, behind);
    for (const object of hidden) object.visible = true;
  }

  /** The current view as a PNG. */
  png(wanted: Wanted): Promise<Blob | null> {
    return takePicture(this.stage, this.ground.objects, wanted);
  }

  private build(scene: Scene): void {
    this.drawn = null;
    this.bodies?.dispose();
    if (this.robot !== null && this.robot.scene.links === scene.links) {
      this.createBodies(scene);
      return;
    }
    if (this.robot !== null) this.removeRobot(this.robot.group);
    if (this.robot?.links.length === 0) this.placed = false; // the first robot comes into view
    this.ids.clear();
    forgetPrimitives();
    const changed = (): void => this.stage.invalidate();
    this.robot = new RobotObject(scene, this.ids, changed);
    this.createBodies(scene);
    this.world.add(this.robot.group);
    this.paint();
    this.robot.select(this.app.selected.value);
  }

  /** Removes a robot. Its compiled materials are kept until the next robot, which has the same ones, is drawn: compiling
   * them again would take longer than everything else from a saved file to the view. */
  private removeRobot(robot: Object3D): void {
    robot.removeFromParent();
    if (this.removedRobot !== null) {
      dispose(robot); // this robot was never drawn
      return;
    }
    this.removedRobot = robot;
    this.stage.afterFrame(() => {
      dispose(robot);
      this.removedRobot = null;
    });
  }

  /** Creates the bodies of a scene. */
  private createBodies(scene: Scene): void {
    const shown = this.bodies?.group.visible ?? true;
    this.bodies = new Bodies(scene, this.ids, () => {
      this.castsFrom = null;
      this.stage.invalidate();
    });
    this.bodies.group.visible = shown;
    this.bodies.setEdges(PALETTES[this.app.theme.value].edge);
    this.world.add(this.bodies.group);
    const world = this.app.about.value?.world ?? "";
    this.reframes = this.placed && world !== this.framedWorld;
    this.framedWorld = world;
    this.ground.fitTo(scene.radius, scene.ground);
  }

  private apply(state: State): void {
    if (this.robot === null) return;
    this.fixFrame();
    this.robot.apply(state);
    this.bodies?.apply(state);
    this.displays.state(state);
    const isGone = state.fallen.some(({ name }) => name === "");
    const { frame } = this.viewpoint;
    const start = new Vector3().applyMatrix4(this.world.matrix); // the camera does not follow a robot that fell out of the world
    const followed = isGone ? (this.placed ? this.lastSeen : start) : this.origin(frame);
    this.stage.isReady = true;
    if (!this.placed) {
      this.placed = true;
      const { value: view } = this.app.requestedView;
      if (!this.viewpoint.applyAddress()) {
        if (view === null) this.viewpoint.showStart(followed === start ? start : this.centre());
        else this.viewpoint.applyFile(view);
      }
    } else if (this.reframes && !this.app.options.value.ride) {
      this.viewpoint.showStart(this.centre());
    } else if (this.app.options.value.ride) {
      this.viewpoint.ride();
      this.stage.invalidate();
    } else if (this.app.follows && frame === this.lastFrame) {
      const moved = followed.clone().sub(this.lastSeen);
      this.stage.controls.target.add(moved);
      this.stage.camera.position.add(moved);
    }
    this.reframes = false;
    this.lastSeen.copy(followed);
    this.lastFrame = frame;
    const radius = this.app.scene.value?.radius ?? 1;
    this.stage.lights.aimAt(this.centre(), radius * 1.5);
    if (this.drawn === null || !looksTheSame(state, this.drawn)) this.stage.invalidate();
    this.drawn = state;
  }

  private get root(): Vector3 {
    return this.rootObject?.position ?? new Vector3();
  }

  get pictureFromWorld(): Matrix4 {
    return this.world.matrix;
  }

  get rootObject(): Object3D | undefined {
    const scene = this.app.scene.value;
    return this.robot?.links.find((link) => link.view.name === scene?.root)?.group;
  }

  centre(): Vector3 {
    const scene = this.app.scene.value;
    if (scene === null) return new Vector3();
    const { x, y, z } = this.root;
    const [cx = 0, cy = 0, cz = 0] = scene.centre;
    return new Vector3(x + cx, y + cy, z + cz).applyMatrix4(this.world.matrix);
  }

  origin(frame: string): Vector3 {
    const place = frame === "" ? null : this.transforms.lookup(frame, null);
    return (place === null ? this.root.clone() : new Vector3().setFromMatrixPosition(place)).applyMatrix4(
      this.world.matrix,
    );
  }

  private beforeFrame(): void {
    const { camera, controls } = this.stage;
    camera.updateMatrixWorld(); // displays and tools project points with it
    const centre = controls.target.clone().applyMatrix4(this.world.matrix.clone().invert());
    this.ground.follow(
      centre.x,
      centre.y,
      Math.max(this.stage.heightSeen * 1.75, (this.app.scene.value?.radius ?? 0.1) * 2),
    );
    this.bodies?.fadeOccluders(camera.position, this.centre(), this.app.scene.value?.radius ?? 0.1);
    this.displays.frame();
    this.castShadows();
  }

  private castShadows(): void {
    const bodies = this.bodies?.group.visible ? this.bodies : null;
    const { contacts } = this.ground;
    if (bodies !== this.castsFrom) contacts.setStill(bodies?.solids(false) ?? []);
    this.castsFrom = bodies;
    contacts.setMoving([...(bodies?.solids(true) ?? []), ...(this.robot?.solids() ?? [])]);
  }

  /** The size at which a sprite covers one CSS pixel: relative to the distance, or in m without perspective. */
  get perPixel(): number {
    const { heightSeen, isOrthographic, distance } = this.stage;
    return (isOrthographic ? heightSeen : heightSeen / distance) / Math.max(1, this.stage.size.y);
  }

  private paint(): void {
    const theme = this.app.theme.value;
    const palette = PALETTES[theme];
    this.stage.setTheme(theme);
    this.ground.setTheme(theme);
    this.robot?.setEdges(palette.edge);
    this.bodies?.setEdges(palette.edge);
    if (this.robot !== null) this.displays.rebuild(this.robot.scene);
    this.showOptions();
    this.showGlobals();
  }

  /** Moves the world so that the fixed frame stands still. */
  private fixFrame(): void {
    const fixed = this.transforms.lookup(this.fixedFrame, null)?.invert();
    if (fixed === undefined || fixed.equals(this.world.matrix)) return;
    this.world.matrix.copy(fixed);
    this.world.matrixWorldNeedsUpdate = true;
  }

  private showGlobals(): void {
    const { displays } = this.app;
    const background = String(displays.global("background"));
    const colour = background || PALETTES[this.app.theme.value].background;
    this.stage.setBackground(colour);
    this.ground.setBackground(background);
    this.stage.lights.setBrightness(Number(displays.global("light")));
    this.ground.showFloor(displays.global("floor") === true);
    const before = this.centre();
    this.fixFrame();
    const moved = this.centre().sub(before);
    if (this.placed && moved.length() > 0) {
      this.stage.controls.target.add(moved);
      this.stage.camera.position.add(moved);
      this.lastSeen.copy(this.origin(this.viewpoint.frame));
    }
    this.stage.invalidate();
  }

  private showOptions(): void {
    const options = this.app.options.value;
    this.stage.controls.enabled = !options.ride;
    this.stage.setOrthographic(options.flat && !options.ride);
    this.stage.lockSide(options.side);
    const kind = [options.flat, options.ride, options.follow].join(" ");
    if (this.kind !== "" && kind !== this.kind && this.placed) this.viewpoint.writeAddress();
    this.kind = kind;
    this.stage.invalidate();
  }
}
