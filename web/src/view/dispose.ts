import type { Mesh, Object3D } from "three";

/** Frees what an object's own materials and geometries hold on the graphics card. */
export function dispose(root: Object3D): void {
  root.traverse((object) => {
    const { geometry, material } = object as Partial<Mesh>;
    geometry?.dispose();
    for (const one of Array.isArray(material) ? material : material ? [material] : []) one.dispose();
  });
  root.removeFromParent();
}
