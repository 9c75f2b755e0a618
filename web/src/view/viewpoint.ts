import { Box3, Object3D, Vector3 } from "three";

import type { App } from "../app";
import type { ViewSettings } from "../displays/set";
import { readView, viewHash } from "./address";
import type { RobotObject } from "./robot";
import { sideOf, SIDES, type Side } from "./sides";
import type { Stage } from "./stage";

/** Azimuth and elevation of the default view in degrees. */
const ASLANT = [215, 28] as const;

/** The objects that the camera can look at. */
export interface ViewTarget {
  readonly robot: RobotObject | null;
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
      follow: app.options.value.follow,
    });
  }

  /** The current view, relative to the followed frame if any, because that may have moved when the view is restored. */
  private relativeView(): { eye: number[]; target: number[]; frame: string } {
    const { follow } = this.app.options.value;
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

  /** Like `fit`, but does not change the URL. */
  showAll(middle = this.target.centre()): void {
    const scene = this.app.scene.value;
    if (scene === null) return;
    const { side } = this.app.options.value;
    const [azimuth, elevation] = side === "" ? ASLANT : SIDES[side];
    const wide = this.app.about.value?.mode === "sim" ? 2.1 : 1.05;
    this.stage.look(middle, this.stage.distanceFor(scene.radius * wide), azimuth, elevation);
  }

  /** Zooms to a link, from the current direction. */
  focus(name: string): void {
    const link = this.target.robot?.links.find((candidate) => candidate.view.name === name);
    if (link === undefined) return;
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
    const { flat, ride, follow } = this.app.options.value;
    const hash = viewHash({ ...this.relativeView(), orthographic: flat, ride, follow });
    history.replaceState(null, "", hash);
  }
}
