import { Box3, Object3D, Vector3 } from "three";

import type { App } from "../app";
import type { LookingFrom } from "../displays/set";
import { readView, viewHash } from "./address";
import type { RobotObject } from "./robot";
import { sideOf, SIDES, type Side } from "./sides";
import type { Stage } from "./stage";

/** Azimuth and elevation in degrees. */
const ASLANT = [215, 28] as const;

/** What one looks at. */
export interface Seen {
  readonly robot: RobotObject | null;
  readonly rootObject: Object3D | undefined;
  /** Middle of the robot, in the picture. */
  centre(): Vector3;
  /** The origin of a frame, in the picture; that of the robot's root where there is no such frame. */
  origin(frame: string): Vector3;
}

/** From where one looks: at all or at a link, from a side, as the robot sees, as an address or a file says. */
export class Looking {
  /** The frame that one looks along with, empty for the robot's root. */
  frame = "";

  constructor(
    private readonly app: App,
    private readonly stage: Stage,
    private readonly seen: Seen,
  ) {
    stage.controls.addEventListener("end", () => this.writeAddress());
    app.lookingFrom = () => ({
      ...this.told(),
      flat: stage.isOrthographic,
      follow: app.options.value.follow,
    });
  }

  /** From where and at what, told from the frame that is followed, where one is: it may have moved when one looks again. */
  private told(): { eye: number[]; target: number[]; frame: string } {
    const { follow } = this.app.options.value;
    const origin = follow ? this.seen.origin(this.frame) : new Vector3();
    const from = (place: Vector3): number[] => place.clone().sub(origin).toArray();
    return {
      eye: from(this.stage.eye),
      target: from(this.stage.controls.target),
      frame: follow ? this.frame || (this.app.scene.value?.root ?? "") : "",
    };
  }

  private lookFrom(eye: readonly number[], target: readonly number[], frame: string): void {
    this.frame = frame === this.app.scene.value?.root ? "" : frame;
    const origin = frame === "" ? new Vector3() : this.seen.origin(this.frame);
    this.stage.camera.position.fromArray(eye).add(origin);
    this.stage.lookAt(new Vector3().fromArray(target).add(origin));
  }

  /** Looks at the whole robot, from the side that is held or aslant from above. */
  fit(): void {
    this.atAll();
    this.writeAddress();
  }

  /** Looks from a side without perspective and stays there; from where it did already, aslant again. */
  fromSide(side: Side): void {
    const { options } = this.app;
    const isLeft = options.value.side === side;
    options.set({ ...options.value, side: isLeft ? "" : side, flat: !isLeft, ride: false });
    this.fit();
  }

  /** As `fit`, and says nothing of it in the address. */
  atAll(middle = this.seen.centre()): void {
    const scene = this.app.scene.value;
    if (scene === null) return;
    const { side } = this.app.options.value;
    const [azimuth, elevation] = side === "" ? ASLANT : SIDES[side];
    const wide = this.app.about.value?.mode === "sim" ? 2.1 : 1.05;
    this.stage.look(middle, this.stage.distanceFor(scene.radius * wide), azimuth, elevation);
  }

  /** Looks at one link so that it fills the picture, from the side it is seen from now. */
  focus(name: string): void {
    const link = this.seen.robot?.links.find((one) => one.view.name === name);
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

  /** Sees what the robot would: from above its front, ahead. */
  ride(): void {
    const { camera, controls } = this.stage;
    const radius = this.app.scene.value?.radius ?? 0.1;
    const base = this.seen.rootObject;
    if (base === undefined) return;
    base.updateWorldMatrix(true, false);
    camera.position.set(-radius * 0.4, 0, radius * 1.5).applyMatrix4(base.matrixWorld);
    controls.target.set(radius * 3, 0, radius * 0.7).applyMatrix4(base.matrixWorld);
  }

  /** Looks from where a file of displays says. */
  fromFile({ eye, target, flat, follow, frame = "" }: LookingFrom): void {
    this.app.options.set({
      ...this.app.options.value,
      flat,
      follow,
      ride: false,
      side: flat ? sideOf(eye, target) : "",
    });
    this.lookFrom(eye, target, frame);
  }

  /** Takes the view from the page's address, where it has one. */
  openAddress(): boolean {
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
    this.lookFrom(view.eye, view.target, view.frame);
    return true;
  }

  /** Puts the view into the page's address, so that a link to it opens the same. */
  writeAddress(): void {
    if (location.protocol === "about:") return; // within another page, which has the address
    const { flat, ride, follow } = this.app.options.value;
    const hash = viewHash({ ...this.told(), orthographic: flat, ride, follow });
    history.replaceState(null, "", hash);
  }
}
