import { Matrix4, PerspectiveCamera } from "three";

import type * as msg from "../messages";

/** Near plane in m, as in rviz. */
const NEAR = 0.01;
/** A three.js camera looks along -z with y up, an optical frame (REP 103) along z with y down. */
const OPTICAL_FROM_EYE = new Matrix4().makeRotationX(Math.PI);

/** A camera in an optical frame with the intrinsics of a CameraInfo. */
export class Pinhole {
  readonly eye = new PerspectiveCamera();

  constructor() {
    this.eye.matrixAutoUpdate = false;
  }

  /** Applies a camera's projection matrix, enlarged by `zoom` around the image centre, with the far plane at `far` m.
   * Returns whether the projection is valid. */
  see({ p, width, height }: msg.CameraInfo, zoom: number, far: number): boolean {
    const [fx = 0, , cx = 0, tx = 0, , fy = 0, cy = 0, ty = 0] = p;
    if (!(fx > 0 && fy > 0 && width > 0 && height > 0)) return false;
    const { eye } = this;
    eye.projectionMatrix.set(
      (2 * zoom * fx) / width,
      0,
      1 - (2 * cx) / width,
      0,
      0,
      (2 * zoom * fy) / height,
      (2 * cy) / height - 1,
      0,
      0,
      0,
      -(far + NEAR) / (far - NEAR),
      (-2 * far * NEAR) / (far - NEAR),
      0,
      0,
      -1,
      0,
    );
    eye.projectionMatrixInverse.copy(eye.projectionMatrix).invert();
    // Tx and Ty offset the second camera of a stereo pair from the frame: sensor_msgs/CameraInfo
    eye.matrix.makeTranslation(-tx / fx, -ty / fy, 0).multiply(OPTICAL_FROM_EYE);
    eye.matrixWorldNeedsUpdate = true;
    return true;
  }
}
