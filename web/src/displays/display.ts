import type { Object3D, PerspectiveCamera, Texture, Vector2, Vector3 } from "three";

import type { App } from "../app";
import type { Scene, State, TopicMessage } from "../protocol";
import type { Bodies } from "../view/bodies";
import type { Ground } from "../view/ground";
import type { RobotObject } from "../view/robot";
import type { Transforms } from "../view/transforms";
import type { Status, Values } from "./set";

/** The parts of the 3D view that a display can use. */
export interface Picture {
  readonly app: App;
  readonly transforms: Transforms;
  readonly ground: Ground;
  readonly robot: RobotObject | null;
  readonly bodies: Bodies | null;
  /** Name of the fixed frame. */
  readonly fixedFrame: string;
  /** The element that holds windows over the view. */
  readonly overlay: HTMLElement;
  /** Radius of the robot in m, which scales lines and arrows. */
  readonly radius: number;
  /** Size of a CSS pixel in m at a distance of 1 m, or at any distance without perspective. */
  readonly perPixel: number;
  /** The place of a point of the world in the view, in CSS pixels from the top left. */
  onScreen(point: Vector3): Vector2;
  invalidate(): void;
  /** Draws the scene from another camera onto a canvas. An image `behind` replaces the floor. Only displays whose names
   * pass `isSeen` are drawn. */
  drawAs(
    eye: PerspectiveCamera,
    onto: CanvasRenderingContext2D,
    behind: Texture | null,
    isSeen: (display: string) => boolean,
  ): void;
}

/** A display in the view. Its group is in world coordinates. Optional methods are called only if implemented. */
export interface Display {
  readonly group: Object3D;
  /** An object that the view draws for it, besides its group. */
  readonly beside?: Object3D | undefined;
  /** Applies its settings. Called before all other methods. `shown` is whether it is enabled. */
  configure(values: Values, shown: boolean): void;
  /** Rebuilds what depends on the robot, the world or the theme, after one of them changed. */
  rebuild?(scene: Scene): void;
  state?(state: State): void;
  /** Handles a message of its topic. Returns what is wrong with it, possibly later. */
  message?(message: TopicMessage): Status | null | Promise<Status | null>;
  /** Whether it accepts messages with null numbers. Otherwise they are reported as invalid and not shown. */
  readonly takesGaps?: boolean;
  /** The marker namespaces that it shows. */
  readonly namespaces?: readonly string[];
  /** Removes what it shows of its topic, because the topic changed. */
  clear?(): void;
  /** A link was selected. */
  select?(link: string): void;
  /** The status of a display without a topic, null if it is fine. */
  status?(): Status | null;
  /** Called before each frame. */
  frame?(): void;
  /** Called after all `frame` calls, for displays that render the scene themselves. */
  look?(): void;
  dispose(): void;
}

export type Make = (picture: Picture) => Display;
