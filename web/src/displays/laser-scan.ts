import { BufferGeometry, Color, Float32BufferAttribute, Points, PointsMaterial } from "three";

import type * as msg from "../messages";
import type { Make } from "./display";
import { placeAtHeader } from "./frames";

/** What a lidar sees, as points that stay where they were seen. */
export const laserScan: Make = (picture) => {
  const points = new Points(new BufferGeometry(), new PointsMaterial({ sizeAttenuation: false, toneMapped: false, transparent: true }));
  points.frustumCulled = false;
  points.matrixAutoUpdate = false;
  return {
    group: points,
    configure(values) {
      points.material.color = new Color(values["colour"] as string);
      points.material.size = values["size"] as number;
      points.material.opacity = values["alpha"] as number;
    },
    message({ message }) {
      const scan = message as unknown as msg.LaserScan;
      points.geometry.dispose();
      points.geometry = new BufferGeometry();
      points.geometry.setAttribute("position", new Float32BufferAttribute(scanPoints(scan), 3));
      return placeAtHeader(picture, points, scan.header);
    },
    clear() {
      points.geometry.dispose();
      points.geometry = new BufferGeometry();
    },
    dispose() {
      points.geometry.dispose();
      points.material.dispose();
    },
  };
};

/** x, y, z of each beam that came back, in the lidar's frame. */
function scanPoints(scan: msg.LaserScan): number[] {
  const points: number[] = [];
  scan.ranges.forEach((range, beam) => {
    if (!Number.isFinite(range) || range < scan.range_min || range > scan.range_max) return;
    const angle = scan.angle_min + beam * scan.angle_increment;
    points.push(range * Math.cos(angle), range * Math.sin(angle), 0);
  });
  return points;
}
