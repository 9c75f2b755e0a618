import {
  Color,
  ConeGeometry,
  Group,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  Quaternion,
  TorusGeometry,
  Vector3,
} from "three";

import type * as msg from "../messages";
import type { Make } from "./display";
import { placeAtHeader } from "./frames";
import { PoseShapes } from "./pose-shapes";
import type { Values } from "./set";

const X = new Vector3(1, 0, 0);
const Z = new Vector3(0, 0, 1);
const ARC = 1.5 * Math.PI;

/** Twist and Wrench: an arrow for the linear part, and a ring with an arrowhead for the angular part. */
export const twist: Make = (picture) => {
  const group = new Group();
  const arrow = new PoseShapes();
  const turn = new MeshLambertMaterial();
  const ring = new Group();
  group.add(arrow.group, ring);
  let set: Values = {};
  let current: msg.Twist | null = null; // or a wrench, with the force as linear and the torque as angular part
  let isStamped = false;
  const freeRing = (): void =>
    ring.traverse((object) => {
      const { geometry } = object as Partial<Mesh>;
      geometry?.dispose();
    });
  const draw = (): void => {
    freeRing();
    ring.clear();
    const straight = vector(current?.linear);
    const length = straight.length() * Number(set["linear_scale"]);
    const along = new Quaternion().setFromUnitVectors(X, straight.clone().normalize());
    arrow.put(length > 1e-6 ? [new Matrix4().makeRotationFromQuaternion(along)] : [], length);
    const about = vector(current?.angular);
    const radius = about.length() * Number(set["angular_scale"]);
    if (radius < 1e-6) return;
    const thick = radius * 0.06;
    const head = new Mesh(new ConeGeometry(thick * 3, thick * 7, 16), turn);
    head.position.set(radius * Math.cos(ARC), radius * Math.sin(ARC), 0);
    head.rotation.z = ARC;
    ring.add(new Mesh(new TorusGeometry(radius, thick, 10, 48, ARC), turn), head);
    ring.quaternion.setFromUnitVectors(Z, about.normalize());
  };
  return {
    group,
    configure(values) {
      set = values;
      arrow.style("arrow", String(values["linear"]), Number(values["alpha"]));
      turn.color = new Color(values["angular"] as string);
      turn.opacity = values["alpha"] as number;
      turn.transparent = turn.opacity < 1;
      draw();
    },
    message({ message }) {
      const {
        header,
        twist: stamped,
        wrench,
      } = message as { header?: msg.Header; twist?: msg.Twist; wrench?: msg.Wrench };
      current =
        stamped ??
        (wrench === undefined
          ? (message as unknown as msg.Twist)
          : { linear: wrench.force, angular: wrench.torque });
      isStamped = header !== undefined;
      draw();
      // a message without a header belongs to the robot's root at its current pose
      return header === undefined ? null : placeAtHeader(picture, group, header);
    },
    frame() {
      const root = picture.app.scene.value?.root;
      if (isStamped || root === undefined) return;
      group.matrixAutoUpdate = false;
      if (picture.transforms.lookup(root, null, group.matrix) !== null) group.matrixWorldNeedsUpdate = true;
    },
    clear() {
      current = null;
      draw();
    },
    dispose() {
      arrow.dispose();
      freeRing();
      turn.dispose();
    },
  };
};

function vector(of: msg.Vector3 | undefined): Vector3 {
  return new Vector3(of?.x ?? 0, of?.y ?? 0, of?.z ?? 0);
}
