import {
  BoxGeometry,
  BufferGeometry,
  CapsuleGeometry,
  CylinderGeometry,
  SphereGeometry,
  Vector3,
} from "three";

import type { Shape } from "../protocol";

const cache = new Map<string, BufferGeometry>();

/** The geometry of a primitive, along z as in URDF. Equal primitives share it. */
export function primitive(shape: Shape): BufferGeometry {
  const key = `${shape.kind} ${shape.size.join(" ")}`;
  let geometry = cache.get(key);
  if (geometry === undefined) {
    geometry = build(shape);
    cache.set(key, geometry);
  }
  return geometry;
}

/** The geometry of a primitive in unit size, to be scaled by `sized`. Primitives of all sizes share it. */
export function unit(shape: Shape): BufferGeometry {
  const [a = 0, b = 0] = shape.size;
  const sizes = {
    box: [1, 1, 1],
    cylinder: [1, 1],
    sphere: [1],
    ellipsoid: [1, 1, 1],
    capsule: [a, b],
    mesh: [],
  }[shape.kind];
  const geometry = primitive({
    ...shape,
    kind: shape.kind === "ellipsoid" ? "sphere" : shape.kind,
    size: sizes,
  });
  geometry.userData["edged"] = shape.kind === "box" || shape.kind === "cylinder";
  return geometry;
}

/** The scale of a shape's unit geometry along x, y, z. */
export function sized(shape: Shape): Vector3 {
  const [a = 1, b = 1, c = 1] = shape.size;
  switch (shape.kind) {
    case "cylinder":
      return new Vector3(a, a, b);
    case "sphere":
      return new Vector3(a, a, a);
    case "capsule":
      return new Vector3(1, 1, 1);
    default:
      return new Vector3(a, b, c);
  }
}

/** Frees the primitives of a removed scene. */
export function forgetPrimitives(): void {
  for (const geometry of cache.values()) geometry.dispose();
  cache.clear();
}

function build(shape: Shape): BufferGeometry {
  const [a = 0, b = 0, c = 0] = shape.size;
  switch (shape.kind) {
    case "box":
      return new BoxGeometry(a, b, c);
    case "cylinder":
      return new CylinderGeometry(a, a, b, 64).rotateX(Math.PI / 2);
    case "capsule":
      return new CapsuleGeometry(a, b, 12, 40).rotateX(Math.PI / 2);
    case "sphere":
      return new SphereGeometry(a, 48, 32).rotateX(Math.PI / 2);
    case "ellipsoid":
      return new SphereGeometry(1, 48, 32).rotateX(Math.PI / 2).scale(a, b, c);
    case "mesh":
      return new BufferGeometry();
  }
}
