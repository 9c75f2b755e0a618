import { Matrix4, Quaternion, Vector3 } from "three";

import type { Findings, Scene } from "../protocol";
import { NOTHING, type Parts } from "../view/robot";
import type { Make } from "./display";
import { fallenStatus } from "./fallen";
import { PoseShapes } from "./pose-shapes";
import type { Status, Values } from "./set";

const X = new Vector3(1, 0, 0);
const JOINTS = "#2dd4bf";
/** Codes of findings about meshes that cannot be shown. */
const NO_MESH = new Set(["F008", "G101", "G102"]);

/** RobotModel: the visible parts of the robot, and the axes of its joints. */
export const robotModel: Make = (picture) => {
  const axes = new PoseShapes();
  axes.style("arrow", JOINTS, 1);
  let set: Values = {};
  let isShown = false;
  const parts = (link: string): Parts => {
    if (!isShown || set[`${link}/show`] === false) return NOTHING;
    return {
      visual: set["visual"] === true,
      collision: set["collision"] === true,
      inertia: set["inertia"] === true,
      inertiaShape: set["inertia_shape"] === "ellipsoid" ? "ellipsoid" : "box",
      mass: set["mass"] === true,
      alpha: Number(set["alpha"]) * Number(set[`${link}/alpha`] ?? 1),
    };
  };
  return {
    group: axes.group,
    get beside() {
      return picture.robot?.group;
    },
    configure(values, shown) {
      set = values;
      isShown = shown;
      picture.robot?.show(parts);
    },
    rebuild: () => picture.robot?.show(parts),
    status: () =>
      fallenStatus((picture.app.state.value?.fallen ?? []).filter(({ name }) => name === "")) ??
      missingStatus(picture.app.findings.value) ??
      bareStatus(picture.app.scene.value),
    frame() {
      const joints = set["joints"] === true ? (picture.app.scene.value?.joints ?? []) : [];
      const matrices = joints.flatMap((joint) => {
        const at = picture.transforms.lookup(joint.child, null);
        const along = new Vector3().fromArray(joint.axis).normalize();
        if (at === null || along.lengthSq() === 0) return [];
        return [
          at.multiply(
            new Matrix4().makeRotationFromQuaternion(new Quaternion().setFromUnitVectors(X, along)),
          ),
        ];
      });
      axes.put(matrices, picture.radius * 0.8);
    },
    dispose() {
      picture.robot?.show(() => NOTHING);
      axes.dispose();
    },
  };
};

/** An error about missing or unreadable meshes, null if there are none. */
function missingStatus(findings: Findings | null): Status | null {
  const links = new Set(
    (findings?.findings ?? []).filter(({ code }) => NO_MESH.has(code)).map(({ link }) => link),
  );
  return links.size === 0
    ? null
    : { level: "error", reason: `meshes are missing (see Findings): ${[...links].join(", ")}` };
}

/** A warning about a robot without shapes, null if it has any. */
function bareStatus(scene: Scene | null): Status | null {
  return scene?.links.some(({ visuals }) => visuals.length > 0) === false
    ? { level: "warn", reason: "no link has a visual, so there is nothing to show" }
    : null;
}
