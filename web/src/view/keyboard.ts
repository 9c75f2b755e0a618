import { OrthographicCamera, Vector3 } from "three";

import { takesKeys } from "../focus";
import type { Stage } from "./stage";

/** Per key press: rotation in rad, movement as a fraction of the view's height, and zoom factor. */
const TURN = Math.PI / 36;
const MOVE = 1 / 20;
const CLOSER = 1.1;
const STEEPEST = Math.PI / 2 - 1e-3;
const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/** Shift + arrow rotates the view, Ctrl + arrow pans, + and - zoom. Calls `done` after each. */
export function lookByKeys(stage: Stage, done: () => void): void {
  addEventListener("keydown", (event) => {
    if (event.altKey || event.metaKey || takesKeys(event) || !stage.controls.enabled) return;
    const [right, up] = ARROWS[event.key] ?? [0, 0];
    const isArrow = event.key in ARROWS;
    if (isArrow && event.shiftKey && !event.ctrlKey && stage.controls.enableRotate) turn(stage, right, up);
    else if (isArrow && event.ctrlKey && !event.shiftKey) move(stage, right, up);
    else if (event.key === "+" && !event.ctrlKey) zoom(stage, CLOSER);
    else if (event.key === "-" && !event.ctrlKey) zoom(stage, 1 / CLOSER);
    else return;
    event.preventDefault();
    stage.invalidate();
    done();
  });
}

/** Rotates the camera around its target. The controls apply the limits of a locked side. */
export function turn({ camera, controls }: Stage, right: number, up: number): void {
  const { x, y, z } = camera.position.clone().sub(controls.target);
  const distance = Math.hypot(x, y, z);
  const azimuth = Math.atan2(y, x) + right * TURN;
  const elevation = Math.min(STEEPEST, Math.max(-STEEPEST, Math.asin(z / distance) + up * TURN));
  const level = Math.cos(elevation) * distance;
  camera.position
    .set(level * Math.cos(azimuth), level * Math.sin(azimuth), distance * Math.sin(elevation))
    .add(controls.target);
}

function move({ camera, controls, heightSeen }: Stage, right: number, up: number): void {
  const axis = (column: number): Vector3 => new Vector3().setFromMatrixColumn(camera.matrix, column);
  const by = axis(0)
    .multiplyScalar(right)
    .addScaledVector(axis(1), up)
    .multiplyScalar(heightSeen * MOVE);
  camera.position.add(by);
  controls.target.add(by);
}

function zoom({ camera, controls }: Stage, factor: number): void {
  if (camera instanceof OrthographicCamera) {
    camera.zoom *= factor;
    camera.updateProjectionMatrix();
  } else camera.position.sub(controls.target).divideScalar(factor).add(controls.target);
}
