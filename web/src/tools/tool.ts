import type { Vector3 } from "three";

import type { IconName } from "../icons";
import type { Place } from "./pick";

/** A way to use the pointer in the view. Without `press` the pointer rotates the view and selects. */
export interface Tool {
  readonly name: string;
  readonly label: string;
  readonly key: string;
  readonly image: IconName;
  /** A sentence that explains its use. */
  readonly hint: string;
  /** Whether it needs a simulation. */
  readonly simulated: boolean;
  /** Its options, shown while it is active. */
  readonly options?: HTMLElement;
  /** The pointer moved without being pressed. */
  hover?(place: Place | null): void;
  /** Undoes the last step. Returns whether there was one. */
  back?(): boolean;
  /** The pointer was pressed on a surface. Returns whether the tool can act there. */
  press?(place: Place): boolean;
  /** The pointer was dragged to a point in the horizontal plane through the pressed one. */
  drag?(point: Vector3): void;
  /** The pointer was released. Returns whether the tool is finished. */
  release?(): boolean;
  /** The drag was cancelled. */
  cancel?(): void;
  /** Another tool was selected. */
  leave?(): void;
}
