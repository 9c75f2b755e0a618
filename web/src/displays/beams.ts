import { BufferGeometry, Float32BufferAttribute, LineBasicMaterial, LineSegments, type Group } from "three";

import type { Values } from "./set";

/** Largest number of lines: the beams stay apart, and in software rendering 90 lines take a fifth of a frame's time. */
const MOST = 36;
/** Opacity of a line, as a part of the opacity of the points. A single line leaves the floor visible, and seven lines that
 * overlap near the sensor cover 92 %. */
const FAINT = 0.3;

/** The beams of a lidar that hit something: lines from the sensor to the points of the latest scan. */
export class Beams {
  readonly lines = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ transparent: true, depthWrite: false, toneMapped: false }),
  );
  private isOn = false;

  constructor() {
    this.lines.matrixAutoUpdate = false;
    this.lines.frustumCulled = false;
    this.lines.visible = false;
  }

  set(values: Values): void {
    this.isOn = values["beams"] === true;
    this.lines.material.color.set(String(values["colour"]));
    this.lines.material.opacity = FAINT * Number(values["alpha"]);
    this.lines.visible &&= this.isOn;
  }

  /** Shows the beams to points (flat x, y, z) in the frame of `place`. */
  show(points: Float32Array, place: Group): void {
    this.lines.visible = this.isOn && place.visible;
    if (!this.lines.visible) return;
    const count = points.length / 3;
    const ends: number[] = [];
    for (let i = 0; i < count; i += Math.ceil(count / MOST))
      ends.push(0, 0, 0, points[3 * i]!, points[3 * i + 1]!, points[3 * i + 2]!);
    this.lines.geometry.dispose();
    this.lines.geometry = new BufferGeometry();
    this.lines.geometry.setAttribute("position", new Float32BufferAttribute(ends, 3));
    this.lines.matrix.copy(place.matrix);
    this.lines.matrixWorldNeedsUpdate = true;
  }

  clear(): void {
    this.lines.visible = false;
  }

  dispose(): void {
    this.lines.geometry.dispose();
    this.lines.material.dispose();
  }
}
