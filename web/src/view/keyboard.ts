import { OrthographicCamera, Vector3 } from "three";

import { takesKeys } from "../focus";
import type { Stage } from "./stage";

/** What one press turns by in rad, moves by in parts of the picture's height, and comes closer by. */
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

/** Shift and an arrow turn the view, Ctrl and one move it, + and - come closer and go back; then tells that one did. */
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

/** The eye goes around what it looks at; what does not turn is held by the controls. */
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
