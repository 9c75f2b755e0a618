import { Color, Group, Matrix4, Mesh, MeshLambertMaterial, SphereGeometry } from "three";

import type * as msg from "../messages";
import type { Make } from "./display";
import { placeAtHeader } from "./frames";
import { PoseShapes } from "./pose-shapes";
import type { Values } from "./set";

/** Axes: the axes of one frame. */
export const axes: Make = (picture) => {
  const shapes = new PoseShapes();
  let set: Values = {};
  shapes.style("axes", "", 1);
  return {
    group: shapes.group,
    configure: (values) => void (set = values),
    frame() {
      const at = picture.transforms.lookup(String(set["frame"]) || picture.fixedFrame, null);
      shapes.put(at === null ? [] : [at], Number(set["length"]) || picture.radius);
    },
    status() {
      const name = String(set["frame"]);
      return name === "" || picture.transforms.lookup(name, null) !== null
        ? null
        : { level: "error", reason: `frame ${name} does not exist` };
    },
    dispose: () => shapes.dispose(),
  };
};

/** PointStamped: a point, drawn as a ball. */
export const pointStamped: Make = (picture) => {
  const group = new Group();
  const ball = new Mesh(new SphereGeometry(1, 24, 16), new MeshLambertMaterial());
  ball.visible = false;
  ball.matrixAutoUpdate = false;
  group.add(ball);
  let set: Values = {};
  let at: msg.Point | null = null;
  const draw = (): void => {
    ball.visible = at !== null;
    const radius = Number(set["radius"]) || picture.radius * 0.12;
    if (at !== null)
      ball.matrix = new Matrix4().makeScale(radius, radius, radius).setPosition(at.x, at.y, at.z);
    ball.matrixWorldNeedsUpdate = true;
  };
  return {
    group,
    configure(values) {
      set = values;
      ball.material.color = new Color(values["colour"] as string);
      ball.material.opacity = values["alpha"] as number;
      ball.material.transparent = ball.material.opacity < 1;
      draw();
    },
    message({ message }) {
      const stamped = message as unknown as msg.PointStamped;
      at = stamped.point;
      draw();
      return placeAtHeader(picture, group, stamped.header);
    },
    clear() {
      at = null;
      draw();
    },
    dispose() {
      ball.geometry.dispose();
      ball.material.dispose();
    },
  };
};
