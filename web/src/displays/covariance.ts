import {
  CircleGeometry,
  Color,
  DoubleSide,
  Group,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
  Vector3,
} from "three";

/** Least half axis of the ellipsoid in m. */
const THINNEST = 1e-4;

/** The covariance of a pose: an ellipsoid of one standard deviation, and a fan for the heading. */
export class CovarianceShape {
  readonly group = new Group();
  private readonly material = new MeshBasicMaterial({
    transparent: true,
    depthWrite: false,
    side: DoubleSide,
  });
  private readonly ellipsoid = new Mesh(new SphereGeometry(1, 32, 20), this.material);
  private fan = new Mesh(new CircleGeometry(1, 1), this.material);

  constructor() {
    this.group.add(this.ellipsoid, this.fan);
    this.group.matrixAutoUpdate = this.ellipsoid.matrixAutoUpdate = false;
  }

  style(colour: string, alpha: number): void {
    this.material.color = new Color(colour);
    this.material.opacity = alpha;
  }

  /** `covariance` is the row-major 6 x 6 matrix over x, y, z and rotations, in the frame of the pose's header. `at` is the
   * pose, `length` the radius of the fan in m. */
  put(covariance: readonly number[], at: Matrix4, length: number): void {
    const place = new Vector3().setFromMatrixPosition(at);
    const { values, vectors } = symmetricEigen(
      [0, 1, 2].map((row) => [0, 1, 2].map((column) => covariance[row * 6 + column] ?? 0)),
    );
    const [a, b, c] = values.map((value) => Math.max(THINNEST, Math.sqrt(Math.max(0, value))));
    this.ellipsoid.matrix
      .makeBasis(vectors[0]!, vectors[1]!, vectors[2]!)
      .scale(new Vector3(a, b, c))
      .setPosition(place);
    this.ellipsoid.visible = values.some((value) => value > 0);
    const yaw = Math.min(Math.PI, Math.sqrt(Math.max(0, covariance[35] ?? 0)));
    this.fan.geometry.dispose();
    this.fan.geometry = new CircleGeometry(length, 32, -yaw, 2 * yaw);
    this.fan.matrixAutoUpdate = false;
    this.fan.matrix.copy(at);
    this.fan.visible = yaw > 0;
  }

  dispose(): void {
    this.ellipsoid.geometry.dispose();
    this.fan.geometry.dispose();
    this.material.dispose();
  }
}

/** Eigenvalues and right-handed eigenvectors of a symmetric 3 x 3 matrix, by Jacobi rotations. */
export function symmetricEigen(matrix: number[][]): { values: number[]; vectors: Vector3[] } {
  const a = matrix.map((row) => [...row]);
  const v = [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  for (let sweep = 0; sweep < 12; sweep += 1) {
    for (const [p, q] of [
      [0, 1],
      [0, 2],
      [1, 2],
    ] as const) {
      if (Math.abs(a[p]![q]!) < 1e-15) continue;
      const angle = 0.5 * Math.atan2(2 * a[p]![q]!, a[q]![q]! - a[p]![p]!);
      const [c, s] = [Math.cos(angle), Math.sin(angle)];
      for (let k = 0; k < 3; k += 1)
        [a[k]![p], a[k]![q]] = [c * a[k]![p]! - s * a[k]![q]!, s * a[k]![p]! + c * a[k]![q]!];
      for (let k = 0; k < 3; k += 1)
        [a[p]![k], a[q]![k]] = [c * a[p]![k]! - s * a[q]![k]!, s * a[p]![k]! + c * a[q]![k]!];
      for (let k = 0; k < 3; k += 1)
        [v[k]![p], v[k]![q]] = [c * v[k]![p]! - s * v[k]![q]!, s * v[k]![p]! + c * v[k]![q]!];
    }
  }
  const vectors = [0, 1, 2].map((column) => new Vector3(v[0]![column], v[1]![column], v[2]![column]));
  vectors[2] = vectors[0]!.clone().cross(vectors[1]!);
  return { values: [0, 1, 2].map((i) => a[i]![i]!), vectors };
}
