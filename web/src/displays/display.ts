import type { Object3D, PerspectiveCamera, Texture } from "three";

import type { App } from "../app";
import type { Scene, State, TopicMessage } from "../protocol";
import type { Bodies } from "../view/bodies";
import type { Ground } from "../view/ground";
import type { RobotObject } from "../view/robot";
import type { Transforms } from "../view/transforms";
import type { Status, Values } from "./set";

/** What a display may use of the picture. */
export interface Picture {
  readonly app: App;
  readonly transforms: Transforms;
  readonly ground: Ground;
  readonly robot: RobotObject | null;
  readonly bodies: Bodies | null;
  /** Name of the frame that stands still in the picture. */
  readonly fixedFrame: string;
  /** Where windows over the picture go. */
  readonly overlay: HTMLElement;
  /** Radius of the robot in m: what lines and arrows are sized by. */
  readonly radius: number;
  /** Size in m, at a distance of 1 m or without perspective anywhere, of a CSS pixel. */
  readonly perPixel: number;
  invalidate(): void;
  /** Draws the scene onto a canvas as another eye sees it, with a picture behind it instead of the floor where one is given, without the displays whose names are left out. */
  drawAs(
    eye: PerspectiveCamera,
    onto: CanvasRenderingContext2D,
    behind: Texture | null,
    isSeen: (display: string) => boolean,
  ): void;
}

/** A display that is on show. Its group lies in the world; what is not implemented does not concern it. */
export interface Display {
  readonly group: Object3D;
  /** What the picture itself draws for it, beside its group. */
  readonly beside?: Object3D | undefined;
  /** Takes on its settings; called first. `shown` is whether it is enabled. */
  configure(values: Values, shown: boolean): void;
  /** The robot or the world is another one, or the theme: what was built of them is built anew. */
  rebuild?(scene: Scene): void;
  state?(state: State): void;
  /** A message of its topic; what is wrong with it is said, at once or when it was read. */
  message?(message: TopicMessage): Status | null | Promise<Status | null>;
  /** Whether it takes messages in which numbers are null: without this those are told to be wrong, and not shown. */
  readonly takesGaps?: boolean;
  /** Namespaces of what it shows. */
  readonly namespaces?: readonly string[];
  /** Its topic is another one: what it showed of the one before is gone. */
  clear?(): void;
  /** A link was chosen. */
  select?(link: string): void;
  /** What is wrong with it, where it hears no topic. */
  status?(): Status | null;
  /** A frame is about to be drawn. */
  frame?(): void;
  /** All displays are as they will be drawn: what shows the scene once more does it now. */
  look?(): void;
  dispose(): void;
}

export type Make = (picture: Picture) => Display;
