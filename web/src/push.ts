import { Vector3 } from "three";

import type { App } from "./app";
import type { View } from "./view/view";

/** Milliseconds between two pushes, and the duration of the longest one. */
const EVERY = 50;
const LONGEST = 500;
/** Full force is twice the robot's weight, reached by a drag of `FULL` pixels. */
const WEIGHTS = 2 * 9.81;
const FULL = 200;

/** Shift and drag pushes the link under the pointer in the direction of the drag, while the button is held. */
export function usePush(app: App, view: View): void {
  const { renderer, controls } = view.stage;
  const canvas = renderer.domElement;
  canvas.addEventListener(
    "pointerdown",
    (event) => {
      if (!event.shiftKey || event.button !== 0 || app.about.value?.mode !== "sim") return;
      const box = canvas.getBoundingClientRect();
      const link = view.linkAt(event.clientX - box.left, event.clientY - box.top);
      if (link === "") return;
      event.stopImmediatePropagation();
      event.preventDefault();
      controls.enabled = false;
      startPush(link, event);
    },
    { capture: true },
  );

  const startPush = (link: string, from: PointerEvent): void => {
    let [dx, dy] = [0, 0];
    const mass = app.scene.value?.links.reduce((sum, { inertia }) => sum + (inertia?.mass ?? 0), 0) ?? 1;
    let last = performance.now();
    const send = (): void => {
      // on a slow page the timer fires late, so each push covers the time since the last one
      const now = performance.now();
      const seconds = Math.min(Math.max(now - last, EVERY), LONGEST) / 1000;
      last = now;
      const { camera } = view.stage;
      const right = new Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
      const up = new Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
      const force = right.multiplyScalar(dx).addScaledVector(up, -dy).divideScalar(FULL);
      force.clampLength(0, 1).multiplyScalar(Math.min(500, WEIGHTS * mass));
      app.send({ type: "push", link, x: force.x, y: force.y, z: force.z, seconds });
    };
    const timer = setInterval(send, EVERY);
    const move = (event: PointerEvent): void => {
      dx = event.clientX - from.clientX;
      dy = event.clientY - from.clientY;
    };
    const held = new AbortController();
    const end = (): void => {
      clearInterval(timer);
      controls.enabled = !app.options.value.ride;
      held.abort();
    };
    addEventListener("pointermove", move, { signal: held.signal });
    addEventListener("pointerup", end, { signal: held.signal });
    addEventListener("pointercancel", end, { signal: held.signal });
  };
}
