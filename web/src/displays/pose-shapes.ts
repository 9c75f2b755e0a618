import {
  BufferGeometry,
  Color,
  ConeGeometry,
  CylinderGeometry,
  DynamicDrawUsage,
  Group,
  InstancedMesh,
  Matrix4,
  MeshLambertMaterial,
  Quaternion,
  Vector3,
} from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";

import type { Pose } from "../messages";
import { AXES } from "../view/palette";

const COLOURS = [AXES.x, AXES.y, AXES.z];
const ONE = new Vector3(1, 1, 1);

/** The matrix of a pose. */
export function poseMatrix({ position, orientation }: Pose, into = new Matrix4()): Matrix4 {
  const turn = new Quaternion(orientation.x, orientation.y, orientation.z, orientation.w);
  // a zero quaternion means no rotation, as in rviz
  if (turn.lengthSq() < 1e-12) turn.identity();
  return into.compose(new Vector3(position.x, position.y, position.z), turn.normalize(), ONE);
}

/** An arrow of length 1 along x, with rviz's proportions. */
export function arrowGeometry(): BufferGeometry {
  const shaft = new CylinderGeometry(0.038, 0.038, 0.77, 16).translate(0, 0.385, 0);
  const head = new ConeGeometry(0.077, 0.23, 20).translate(0, 0.885, 0);
  return mergeGeometries([shaft, head]).rotateZ(-Math.PI / 2);
}

/** A rod of length 1 along an axis: 0 is x, 1 is y, 2 is z. */
function rodGeometry(along: number): BufferGeometry {
  const rod = new CylinderGeometry(0.03, 0.03, 1, 12).translate(0, 0.5, 0);
  if (along === 0) rod.rotateZ(-Math.PI / 2);
  if (along === 2) rod.rotateX(Math.PI / 2);
  return rod;
}

/** Arrows or axes of equal size, drawn as instances. */
export class PoseShapes {
  readonly group = new Group();
  private meshes: InstancedMesh<BufferGeometry, MeshLambertMaterial>[] = [];
  private shape = "";
  private colour = "#ffffff";
  private alpha = 1;
  private room = 0;

  style(shape: string, colour: string, alpha: number): void {
    if (shape !== this.shape) this.dispose();
    Object.assign(this, { shape, colour, alpha });
    this.paint();
  }

  /** Draws the shape at each matrix, `length` m long. */
  put(matrices: readonly Matrix4[], length: number): void {
    if (matrices.length > this.room) this.build(Math.max(16, 2 * matrices.length));
    const scale = new Matrix4().makeScale(length, length, length);
    const product = new Matrix4();
    for (const mesh of this.meshes) {
      matrices.forEach((matrix, index) => mesh.setMatrixAt(index, product.multiplyMatrices(matrix, scale)));
      mesh.count = matrices.length;
      mesh.instanceMatrix.needsUpdate = true;
    }
  }

  dispose(): void {
    for (const mesh of this.meshes) {
      mesh.geometry.dispose();
      mesh.material.dispose();
      mesh.dispose();
    }
    this.group.clear();
    this.meshes = [];
    this.room = 0;
  }

  private build(room: number): void {
    this.dispose();
    this.room = room;
    const geometries = this.shape === "axes" ? [0, 1, 2].map(rodGeometry) : [arrowGeometry()];
    this.meshes = geometries.map((geometry) => {
      const mesh = new InstancedMesh(geometry, new MeshLambertMaterial(), room);
      mesh.instanceMatrix.setUsage(DynamicDrawUsage);
      mesh.frustumCulled = false;
      return mesh;
    });
    this.group.add(...this.meshes);
    this.paint();
  }

  private paint(): void {
    this.meshes.forEach(({ material }, index) => {
      material.color = this.shape === "axes" ? new Color(COLOURS[index]) : new Color(this.colour);
      material.opacity = this.alpha;
      material.transparent = this.alpha < 1;
    });
  }
}
