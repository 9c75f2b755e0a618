import { Mesh, MeshBasicMaterial, Vector3 } from "three";

import { arrowGeometry } from "../displays/pose-shapes";
import type { View } from "../view/view";

/** Pixels that the pointer may move during a click. */
const STILL = 6;
const COLOUR = 0x2ecc71;

/** An arrow in a horizontal plane, from the point where the pointer was pressed to where it is: a position and a heading. */
export class Arrow {
  private readonly mesh = new Mesh(
    arrowGeometry(),
    new MeshBasicMaterial({ color: COLOUR, depthTest: false, transparent: true, opacity: 0.9 }),
  );
  readonly start = new Vector3();
  private yaw: number | null = null;

  constructor(private readonly view: View) {
    this.mesh.visible = false;
    this.mesh.renderOrder = 20;
    view.marks.add(this.mesh);
  }

  begin(point: Vector3): void {
    this.start.copy(point);
    this.yaw = null;
    this.show(0, this.view.radius);
  }

  drag(point: Vector3): void {
    const [dx, dy] = [point.x - this.start.x, point.y - this.start.y];
    const length = Math.hypot(dx, dy);
    this.yaw = length > STILL * this.pixel() ? Math.atan2(dy, dx) : null;
    this.show(this.yaw ?? 0, Math.max(length, this.view.radius));
  }

  /** Hides the arrow. Returns the heading in rad, or `otherwise` if the pointer was not dragged. */
  end(otherwise: number): number {
    this.hide();
    return this.yaw ?? otherwise;
  }

  /** Keeps showing the arrow, with a heading in rad. */
  stay(yaw: number): void {
    this.show(yaw, this.view.radius * 1.5);
  }

  hide(): void {
    this.mesh.visible = false;
    this.view.invalidate();
  }

  /** Size of a pixel at the arrow in m. */
  private pixel(): number {
    const { camera, isOrthographic } = this.view.stage;
    return this.view.perPixel * (isOrthographic ? 1 : camera.position.distanceTo(this.start));
  }

  private show(yaw: number, length: number): void {
    this.mesh.position.copy(this.start);
    this.mesh.rotation.z = yaw;
    this.mesh.scale.setScalar(length);
    this.mesh.visible = true;
    this.view.invalidate();
  }
}
