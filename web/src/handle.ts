import { Vector3 } from "three";

import type { App } from "./app";
import type { View } from "./view/view";

/** `window.kbot`: the page's state for scripts and tests. Nothing here changes the robot. */
export interface Handle {
  /** Frames drawn so far. */
  readonly frames: number;
  readonly software: boolean;
  /** Revision of the robot shown, 0 before its first state. */
  readonly revision: number;
  readonly time: number;
  /** Whether a seek is still in progress. */
  readonly seeks: boolean;
  /** x, y, z, qx, qy, qz, qw of each link in the world, flat. */
  poses(): readonly number[];
  /** Ignores the server's states and messages while on. */
  freeze(on: boolean): void;
  /** Draws a frame. Resolves with the number of frames when it is done. */
  drawn(): Promise<number>;
  /** Link index at each pixel, row by row from the top, -1 for none, run-length encoded: index, count, index, … */
  ids(): { width: number; height: number; runs: number[]; links: string[] };
  /** Row-major 4 x 4 matrix from world to clip coordinates, and the size of the canvas. */
  camera(): { clipFromWorld: number[]; width: number; height: number };
  /** Moves the camera to `eye` and looks at `target`. */
  look(eye: [number, number, number], target: [number, number, number]): void;
  /** Numbers of geometries, textures and programs on the graphics card. */
  held(): { geometries: number; textures: number; programs: number };
  /** Position of a link's frame on the page, in CSS pixels. */
  where(link: string): { x: number; y: number } | null;
}

declare global {
  interface Window {
    kbot: Handle;
  }
}

export function handle(app: App, view: View): Handle {
  const { stage } = view;
  const canvas = stage.renderer.domElement;
  const settle = (): void => {
    stage.camera.updateMatrixWorld();
    stage.scene.updateMatrixWorld();
  };
  return {
    get frames() {
      return stage.frames;
    },
    get software() {
      return stage.isSoftware;
    },
    get revision() {
      return app.state.value?.revision ?? 0; // the page accepts only states of the current scene
    },
    get time() {
      return app.state.value?.time ?? 0;
    },
    get seeks() {
      return app.travel.seeks;
    },
    poses() {
      return app.state.value?.poses ?? [];
    },
    freeze(on) {
      app.frozen = on;
    },
    drawn() {
      stage.invalidate();
      return new Promise((resolve) =>
        requestAnimationFrame(() => requestAnimationFrame(() => resolve(stage.frames))),
      );
    },
    ids() {
      settle();
      const { width, height } = canvas;
      return {
        width,
        height,
        runs: runs(view.ids.image(stage.camera, width, height)),
        links: app.scene.value?.links.map((link) => link.name) ?? [],
      };
    },
    camera() {
      settle();
      const clip = stage.camera.projectionMatrix.clone().multiply(stage.camera.matrixWorldInverse);
      return { clipFromWorld: clip.transpose().toArray(), width: canvas.width, height: canvas.height };
    },
    look(eye, target) {
      stage.camera.position.set(...eye);
      stage.lookAt(new Vector3(...target));
    },
    held() {
      const { memory, programs } = stage.renderer.info;
      return { ...memory, programs: programs?.length ?? 0 };
    },
    where(link) {
      settle();
      const object = view.robot?.links.find(({ view: { name } }) => name === link);
      if (object === undefined) return null;
      const at = new Vector3().setFromMatrixPosition(object.group.matrixWorld).project(stage.camera);
      const box = canvas.getBoundingClientRect();
      return { x: box.left + ((at.x + 1) / 2) * box.width, y: box.top + ((1 - at.y) / 2) * box.height };
    },
  };
}

/** Run-length encoding: value, count, value, count, … */
export function runs(values: Int16Array): number[] {
  const result: number[] = [];
  for (const value of values) {
    if (result.length > 0 && result.at(-2) === value) result[result.length - 1]! += 1;
    else result.push(value, 1);
  }
  return result;
}
