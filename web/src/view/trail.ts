import { BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, Mesh, MeshBasicMaterial } from "three";

const MOST = 8000;

/** The path the robot took: a ribbon on the floor, the oldest half forgotten when it is full. */
export class Trail {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly positions = new BufferAttribute(new Float32Array(MOST * 6), 3);
  private points: [number, number][] = [];
  private width = 0.004;
  private spacing = 0.004;

  constructor() {
    this.positions.setUsage(DynamicDrawUsage);
    const index = new Uint32Array((MOST - 1) * 6);
    for (let i = 0; i < MOST - 1; i += 1) index.set([2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 1, 2 * i + 3, 2 * i + 2], i * 6);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", this.positions);
    geometry.setIndex(new BufferAttribute(index, 1));
    geometry.setDrawRange(0, 0);
    this.mesh = new Mesh(geometry, new MeshBasicMaterial({ side: DoubleSide, transparent: true, opacity: 0.85, depthWrite: false }));
    this.mesh.frustumCulled = false;
  }

  suit(radius: number, height: number): void {
    this.width = radius * 0.035;
    this.spacing = radius * 0.03;
    this.mesh.position.z = height + radius * 0.004;
  }

  add(x: number, y: number): void {
    const last = this.points.at(-1);
    if (last !== undefined && Math.hypot(x - last[0], y - last[1]) < this.spacing) return;
    if (this.points.length >= MOST) {
      this.points = this.points.slice(MOST / 2);
      this.points.forEach((_, i) => this.write(i));
    }
    this.points.push([x, y]);
    this.write(this.points.length - 1);
    if (this.points.length > 1) this.write(this.points.length - 2);
    this.positions.needsUpdate = true;
    this.mesh.geometry.setDrawRange(0, Math.max(0, this.points.length - 1) * 6);
  }

  clear(): void {
    this.points = [];
    this.mesh.geometry.setDrawRange(0, 0);
  }

  get length(): number {
    return this.points.length;
  }

  private write(i: number): void {
    const [x, y] = this.points[i]!;
    const before = this.points[i - 1] ?? [x, y];
    const after = this.points[i + 1] ?? [x, y];
    const dx = after[0] - before[0];
    const dy = after[1] - before[1];
    const scale = this.width / 2 / (Math.hypot(dx, dy) || 1);
    this.positions.setXYZ(2 * i, x - dy * scale, y + dx * scale, 0);
    this.positions.setXYZ(2 * i + 1, x + dy * scale, y - dx * scale, 0);
  }
}
