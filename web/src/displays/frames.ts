import type { Object3D } from "three";

import type { Header, Time } from "../messages";
import type { Picture } from "./display";
import type { Status } from "./set";

/** A stamp in seconds. */
export function seconds({ sec, nanosec }: Time): number {
  return sec + nanosec * 1e-9;
}

/** Puts an object where a message's frame was when it was stamped; says so where there is no such frame. */
export function placeAtHeader(picture: Picture, object: Object3D, header: Header): Status | null {
  object.matrixAutoUpdate = false;
  const found = picture.transforms.lookup(header.frame_id, seconds(header.stamp), object.matrix);
  object.visible = found !== null;
  if (found === null)
    return {
      level: "error",
      reason: header.frame_id === "" ? "its messages name no frame" : `there is no frame ${header.frame_id}`,
    };
  object.matrixWorldNeedsUpdate = true;
  return null;
}
