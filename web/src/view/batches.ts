import {
  BufferGeometry,
  Color,
  InstancedBufferAttribute,
  InstancedMesh,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  MeshStandardMaterial,
} from "three";

import { edgesOf, surface } from "./solid";

const NOWHERE = new Matrix4().makeScale(0, 0, 0);
const WHITE = [1, 1, 1, 1];

/** Instanced line segments. The renderer treats an object with these fields as an `InstancedMesh`. */
class InstancedLines extends LineSegments<BufferGeometry, LineBasicMaterial> {
  readonly isInstancedMesh = true;
  readonly instanceColor = null;
  readonly morphTexture = null;

  constructor(
    geometry: BufferGeometry,
    material: LineBasicMaterial,
    readonly instanceMatrix: InstancedBufferAttribute,
    override readonly count: number,
  ) {
    super(geometry, material);
    this.frustumCulled = false;
  }
}

/** Objects of one shape and opacity, drawn as instances. Each has a slot with its own pose, size and colour. */
export class Batch {
  readonly mesh: InstancedMesh<BufferGeometry, MeshStandardMaterial>;
  readonly lines: InstancedLines | null;
  readonly numbers: readonly number[];

  /** `numbers` are the ids of the objects in the id buffer, `colours` their colours in 0..1. */
  constructor(
    geometry: BufferGeometry,
    numbers: readonly number[],
    colours: readonly (readonly number[])[],
    edges: LineBasicMaterial | null,
  ) {
    const material = surface([...WHITE.slice(0, 3), colours[0]?.[3] ?? 1]);
    this.numbers = numbers;
    this.mesh = new InstancedMesh(geometry, material, numbers.length);
    this.mesh.frustumCulled = false;
    this.mesh.castShadow = this.mesh.receiveShadow = !material.transparent;
    const colour = new Color();
    colours.forEach(([r = 1, g = 1, b = 1], slot) =>
      this.mesh.setColorAt(slot, colour.setRGB(r, g, b, "srgb")),
    );
    this.lines =
      edges === null
        ? null
        : new InstancedLines(edgesOf(geometry), edges, this.mesh.instanceMatrix, numbers.length);
  }

  put(slot: number, place: Matrix4): void {
    this.mesh.setMatrixAt(slot, place);
    this.mesh.instanceMatrix.needsUpdate = true;
  }

  hide(slot: number): void {
    this.put(slot, NOWHERE);
  }

  dispose(): void {
    this.mesh.dispose();
  }
}
