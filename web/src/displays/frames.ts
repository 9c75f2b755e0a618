import type { Object3D } from "three";

import type { Header, Time } from "../messages";
import type { Picture } from "./display";
import type { Status } from "./set";

/** A stamp in seconds. */
export function seconds({ sec, nanosec }: Time): number {
  return sec + nanosec * 1e-9;
}

/** Places an object at a message's frame at its stamp. Returns an error if the frame does not exist. */
export function placeAtHeader(picture: Picture, object: Object3D, header: Header): Status | null {
  object.matrixAutoUpdate = false;
  const matrix = picture.transforms.lookup(header.frame_id, seconds(header.stamp), object.matrix);
  object.visible = matrix !== null;
  if (matrix === null)
    return {
      level: "error",
      reason:
        header.frame_id === ""
          ? "the frame_id of the messages is empty"
          : `frame ${header.frame_id} does not exist`,
    };
  object.matrixWorldNeedsUpdate = true;
  return null;
}
