import type { Mesh, Object3D } from "three";

/** Frees the materials and geometries of an object on the graphics card, and removes it from the scene. */
export function dispose(root: Object3D): void {
  root.traverse((object) => {
    const { geometry, material } = object as Partial<Mesh>;
    geometry?.dispose();
    for (const each of Array.isArray(material) ? material : material ? [material] : []) each.dispose();
  });
  root.removeFromParent();
}
