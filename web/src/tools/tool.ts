import type { Vector3 } from "three";

import type { IconName } from "../icons";
import type { Place } from "./pick";

/** One way to use the pointer in the picture. Without `press` the pointer turns the view and selects. */
export interface Tool {
  readonly name: string;
  readonly label: string;
  readonly key: string;
  readonly image: IconName;
  /** What to do with it, in a sentence. */
  readonly hint: string;
  /** Whether something must be simulated for it. */
  readonly simulated: boolean;
  /** More to choose while it is active. */
  readonly options?: HTMLElement;
  /** The pointer is over a place, or over none, without being pressed. */
  hover?(place: Place | null): void;
  /** Takes back the last step; whether there was one. */
  back?(): boolean;
  /** The pointer goes down on a surface; whether there is something to do there. */
  press?(place: Place): boolean;
  /** It moved to a place on the level through the one that was pressed. */
  drag?(point: Vector3): void;
  /** It was let go; whether the tool has done its work. */
  release?(): boolean;
  /** What was begun is off. */
  cancel?(): void;
  /** Another tool takes over. */
  leave?(): void;
}
