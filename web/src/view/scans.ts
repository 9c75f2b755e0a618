import { BufferGeometry, Float32BufferAttribute, Group, Points, PointsMaterial } from "three";

import type { Scan } from "../protocol";
import { SCAN } from "./palette";

const PIXELS = 4;

/** What the lidars see, as points that stay where they were seen. */
export class Scans {
  private readonly points = new Map<string, Points<BufferGeometry, PointsMaterial>>();
  readonly group = new Group();

  put(scan: Scan): void {
    let points = this.points.get(scan.sensor);
    if (points === undefined) {
      points = new Points(new BufferGeometry(), new PointsMaterial({ color: SCAN, size: PIXELS, sizeAttenuation: false, toneMapped: false }));
      points.frustumCulled = false;
      this.group.add(points);
      this.points.set(scan.sensor, points);
    }
    points.geometry.dispose();
    points.geometry = new BufferGeometry();
    points.geometry.setAttribute("position", new Float32BufferAttribute(scan.points as number[], 3));
  }

  show(on: boolean): void {
    this.group.visible = on;
  }
}
