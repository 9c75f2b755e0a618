import { Color, ConeGeometry, DoubleSide, Mesh, MeshBasicMaterial } from "three";

import type * as msg from "../messages";
import type { Make } from "./display";
import { placeAtHeader } from "./frames";

/** Range: a cone with the sensor's field of view, as long as the range. */
export const range: Make = (picture) => {
  const material = new MeshBasicMaterial({ transparent: true, depthWrite: false, side: DoubleSide });
  const mesh = new Mesh(new ConeGeometry(), material);
  const group = mesh;
  mesh.frustumCulled = false;
  const put = (length: number, angle: number): void => {
    mesh.geometry.dispose();
    // three's cone points along y with its centre at the origin; a sensor measures along x from the tip
    mesh.geometry = new ConeGeometry(length * Math.tan(angle / 2), length, 48, 1, true)
      .translate(0, -length / 2, 0)
      .rotateZ(Math.PI / 2);
  };
  put(0, 0);
  return {
    group,
    takesGaps: true,
    configure(values) {
      material.color = new Color(values["colour"] as string);
      material.opacity = values["alpha"] as number;
    },
    message({ message }) {
      const received = message as unknown as Omit<msg.Range, "range"> & { range: number | null };
      const status = placeAtHeader(picture, mesh, received.header);
      // JSON has no infinity: null means that nothing was detected
      const isMet =
        received.range !== null &&
        received.range >= received.min_range &&
        received.range <= received.max_range;
      put(isMet ? received.range! : 0, received.field_of_view);
      return status ?? (isMet ? null : { level: "ok", reason: `nothing within ${received.max_range} m` });
    },
    clear: () => put(0, 0),
    dispose() {
      mesh.geometry.dispose();
      material.dispose();
    },
  };
};
