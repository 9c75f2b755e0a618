import { Color, Group } from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";

import type * as msg from "../messages";
import type { Make } from "./display";
import { placeAtHeader } from "./frames";
import { PoseShapes, poseMatrix } from "./pose-shapes";
import type { Values } from "./set";

/** Path: poses joined by a line. */
export const path: Make = (picture) => {
  const group = new Group();
  const material = new LineMaterial({ transparent: true, toneMapped: false });
  const shapes = new PoseShapes();
  let line: Line2 | null = null;
  let poses: readonly msg.PoseStamped[] = [];
  let set: Values = {};
  group.add(shapes.group);
  const draw = (): void => {
    const isPlain = set["poses"] === "none";
    shapes.style(
      String(set["poses"]) === "axes" ? "axes" : "arrow",
      String(set["colour"]),
      Number(set["alpha"]),
    );
    shapes.put(isPlain ? [] : poses.map(({ pose }) => poseMatrix(pose)), picture.radius * 0.5);
    line?.geometry.dispose();
    line?.removeFromParent();
    line = null;
    if (poses.length < 2) return;
    const geometry = new LineGeometry();
    geometry.setPositions(poses.flatMap(({ pose: { position } }) => [position.x, position.y, position.z]));
    line = new Line2(geometry, material);
    line.frustumCulled = false;
    group.add(line);
  };
  return {
    group,
    configure(values) {
      set = values;
      material.color = new Color(values["colour"] as string);
      material.worldUnits = values["style"] === "billboards";
      material.linewidth = Number(values[material.worldUnits ? "metres" : "width"]);
      material.needsUpdate = true;
      material.opacity = values["alpha"] as number;
      draw();
    },
    message({ message }) {
      const received = message as unknown as msg.Path;
      poses = received.poses;
      draw();
      // the poses may leave their frame_id empty, so the path's header counts; an empty path clears the display
      return poses.length === 0 ? null : placeAtHeader(picture, group, received.header);
    },
    clear() {
      poses = [];
      draw();
    },
    dispose() {
      line?.geometry.dispose();
      material.dispose();
      shapes.dispose();
    },
  };
};

/** Polygon: the outline of a polygon. */
export const polygon: Make = (picture) => {
  const group = new Group();
  const material = new LineMaterial({ transparent: true, toneMapped: false });
  const line = new Line2(new LineGeometry(), material);
  line.frustumCulled = line.visible = false;
  group.add(line);
  return {
    group,
    configure(values) {
      material.color = new Color(values["colour"] as string);
      material.linewidth = values["width"] as number;
      material.opacity = values["alpha"] as number;
    },
    message({ message }) {
      const received = message as unknown as msg.PolygonStamped;
      const { points } = received.polygon;
      line.visible = points.length > 1;
      line.geometry.dispose();
      line.geometry = new LineGeometry();
      if (line.visible)
        line.geometry.setPositions([...points, points[0]!].flatMap(({ x, y, z }) => [x, y, z]));
      return line.visible ? placeAtHeader(picture, group, received.header) : null;
    },
    clear() {
      line.visible = false;
    },
    dispose() {
      line.geometry.dispose();
      material.dispose();
    },
  };
};
