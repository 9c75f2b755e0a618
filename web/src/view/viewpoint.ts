import { Box3, Matrix4, Object3D, Vector3 } from "three";

import type { App } from "../app";
import type { ViewSettings } from "../displays/set";
import { readView, viewHash } from "./address";
import type { Bodies } from "./bodies";
import type { RobotObject } from "./robot";
import { sideOf, SIDES, type Side } from "./sides";
import type { Stage } from "./stage";

/** Azimuth and elevation of the default view in degrees. */
const ASLANT = [215, 28] as const;
/** Azimuth and elevation of an overview in degrees: steep enough to look over the walls of a maze. */
const OVERVIEW = [245, 56] as const;
/** Width in CSS pixels from which the tools have labels, and the space that the tools cover in a wide and in a narrow view:
 * top, right, bottom, left. The style sheet `tools.css` has the same limit. */
const LABELLED = 700;
const [WIDE, NARROW] = [
  [56, 76, 150, 156],
  [96, 76, 185, 12],
] as const;
/** The part of the view's height that an overview leaves to the tools at most. In a lower view, the world keeps a third of
 * the height and the tools cover its edges. */
const MOST_COVERED = 0.65;
/** The share of directions in which walls must surround the robot for an overview. A corridor has one open end. */
const WALLED = 0.7;
/** The largest overview in radii of the robot. In a larger one the robot would be too small to recognise. */
const WIDEST = 60;
/** The radius of a simulation's first view in radii of the robot. On an empty floor, the robot fills half of the view and has
 * room to drive. Among objects, it fills a fifth, so that an object up to this distance away is in the view too. */
const ALONE = 2.1;
const AMONG = 4.8;

/** The objects that the camera can look at. */
export interface ViewTarget {
  readonly robot: RobotObject | null;
  readonly bodies: Bodies | null;
  readonly pictureFromWorld: Matrix4;
  readonly rootObject: Object3D | undefined;
  /** Centre of the robot, in view coordinates. */
  centre(): Vector3;
  /** Origin of a frame in view coordinates, or of the robot's root if the frame does not exist. */
  origin(frame: string): Vector3;
}

/** The viewpoint: fit to the robot or a link, from a side, from the robot, or as given by the URL or a file. */
export class Viewpoint {
  /** The frame that the camera follows, empty for the robot's root. */
  frame = "";

  constructor(
    private readonly app: App,
    private readonly stage: Stage,
    private readonly target: ViewTarget,
  ) {
    stage.controls.addEventListener("end", () => this.writeAddress());
    app.currentView = () => ({
      ...this.relativeView(),
      flat: stage.isOrthographic,
      follow: app.follows,
    });
  }

  /** The current view, relative to the followed frame if any, because that may have moved when the view is restored. */
  private relativeView(): { eye: number[]; target: number[]; frame: string } {
    const follow = this.app.follows;
    const origin = follow ? this.target.origin(this.frame) : new Vector3();
    const from = (place: Vector3): number[] => place.clone().sub(origin).toArray();
    return {
      eye: from(this.stage.eye),
      target: from(this.stage.controls.target),
      frame: follow ? this.frame || (this.app.scene.value?.root ?? "") : "",
    };
  }

  private moveTo(eye: readonly number[], target: readonly number[], frame: string): void {
    this.frame = frame === this.app.scene.value?.root ? "" : frame;
    const origin = frame === "" ? new Vector3() : this.target.origin(this.frame);
    this.stage.camera.position.fromArray(eye).add(origin);
    this.stage.lookAt(new Vector3().fromArray(target).add(origin));
  }

  /** Shows the whole robot, from the locked side or from the default direction. */
  fit(): void {
    this.showAll();
    this.writeAddress();
  }

  /** Locks an orthographic view from a side. If it is locked already, returns to the default view. */
  lockTo(side: Side): void {
    const { options } = this.app;
    const isLeft = options.value.side === side;
    options.set({ ...options.value, side: isLeft ? "" : side, flat: !isLeft, ride: false });
    this.fit();
  }

  /** The first view of a world: all of it if walls surround the robot, otherwise the robot and the objects around it. */
  showStart(middle: Vector3): void {
    const { bodies, pictureFromWorld } = this.target;
    const scene = this.app.scene.value;
    if (scene === null || bodies === null || this.app.options.value.side !== "") return this.showAll(middle);
    const box = bodies.boxAbove(scene.ground + scene.radius * 0.1);
    const eye = middle.clone().applyMatrix4(pictureFromWorld.clone().invert());
    const widest = scene.radius * WIDEST;
    const reach = box.getSize(new Vector3()).length() / 2;
    if (box.isEmpty()) return this.showAll(middle);
    if (reach > widest || bodies.enclosure(eye, widest) < WALLED)
      return this.showAll(middle, box.distanceToPoint(eye) < scene.radius * AMONG ? AMONG : ALONE);
    this.app.overview.set(true);
    const { x, y } = this.stage.size;
    const [top, right, bottom, left] = x < LABELLED ? NARROW : WIDE;
    const part = Math.min(1, (MOST_COVERED * y) / (top + bottom));
    this.stage.lookAtBox(
      box.applyMatrix4(pictureFromWorld),
      [top * part, right, bottom * part, left],
      ...OVERVIEW,
    );
  }

  /** Like `fit`, but does not change the URL. `wide` is the radius of the view in radii of the robot. */
  showAll(middle = this.target.centre(), wide = this.app.about.value?.mode === "sim" ? ALONE : 1.05): void {
    this.app.overview.set(false);
    const scene = this.app.scene.value;
    if (scene === null) return;
    const { side } = this.app.options.value;
    const [azimuth, elevation] = side === "" ? ASLANT : SIDES[side];
    this.stage.look(middle, this.stage.distanceFor(scene.radius * wide), azimuth, elevation);
  }

  /** Zooms to a link, from the current direction. */
  focus(name: string): void {
    const link = this.target.robot?.links.find((candidate) => candidate.view.name === name);
    if (link === undefined) return;
    this.app.overview.set(false);
    const box = new Box3().setFromObject(link.visual);
    if (box.isEmpty())
      box.setFromCenterAndSize(
        link.group.position,
        new Vector3(1, 1, 1).multiplyScalar(this.app.scene.value?.radius ?? 0.1),
      );
    const { camera, controls } = this.stage;
    const centre = box.getCenter(new Vector3());
    const away = camera.position.clone().sub(controls.target).normalize();
    camera.position
      .copy(centre)
      .addScaledVector(away, this.stage.distanceFor(box.getSize(new Vector3()).length() / 2));
    this.stage.lookAt(centre);
    this.writeAddress();
  }

  /** Moves the camera above the robot, looking ahead. */
  ride(): void {
    const { camera, controls } = this.stage;
    const radius = this.app.scene.value?.radius ?? 0.1;
    const base = this.target.rootObject;
    if (base === undefined) return;
    base.updateWorldMatrix(true, false);
    camera.position.set(-radius * 0.4, 0, radius * 1.5).applyMatrix4(base.matrixWorld);
    controls.target.set(radius * 3, 0, radius * 0.7).applyMatrix4(base.matrixWorld);
  }

  /** Applies the view of a display file. */
  applyFile({ eye, target, flat, follow, frame = "" }: ViewSettings): void {
    this.app.options.set({
      ...this.app.options.value,
      flat,
      follow,
      ride: false,
      side: flat ? sideOf(eye, target) : "",
    });
    this.moveTo(eye, target, frame);
  }

  /** Applies the view in the page's URL. Returns whether there is one. */
  applyAddress(): boolean {
    const view = readView(location.hash);
    if (view === null) return false;
    const side = view.orthographic && !view.ride ? sideOf(view.eye, view.target) : "";
    this.app.options.set({
      ...this.app.options.value,
      flat: view.orthographic,
      ride: view.ride,
      follow: view.follow,
      side,
    });
    this.moveTo(view.eye, view.target, view.frame);
    return true;
  }

  /** Writes the view to the page's URL, so that the URL opens the same view. */
  writeAddress(): void {
    if (location.protocol === "about:") return; // embedded in another page, which owns the URL
    const { flat, ride } = this.app.options.value;
    const hash = viewHash({
      ...this.relativeView(),
      orthographic: flat,
      ride,
      follow: this.app.follows,
    });
    history.replaceState(null, "", hash);
  }
}
