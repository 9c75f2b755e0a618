import {
  BoxGeometry,
  BufferGeometry,
  CapsuleGeometry,
  CylinderGeometry,
  SphereGeometry,
} from "three";

import type { Shape } from "../protocol";

const cache = new Map<string, BufferGeometry>();

/** The geometry of a primitive, along z as URDF has it; equal ones are shared. */
export function primitive(shape: Shape): BufferGeometry {
  const key = `${shape.kind} ${shape.size.join(" ")}`;
  let geometry = cache.get(key);
  if (geometry === undefined) {
    geometry = build(shape);
    cache.set(key, geometry);
  }
  return geometry;
}

/** Forgets the primitives of a scene that is gone. */
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
