import { BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, Mesh, MeshBasicMaterial } from "three";

import { PALETTES } from "../view/palette";
import type { Make } from "./display";

const MOST = 8000;

/** The way the robot took. */
export const trail: Make = ({ app }) => {
  const ribbon = new Ribbon();
  let resets = -1;
  let colour = "";
  const paint = (): void => void ribbon.mesh.material.color.set(colour || PALETTES[app.theme.value].trail);
  return {
    group: ribbon.mesh,
    configure(values) {
      colour = String(values["colour"]);
      paint();
    },
    rebuild(scene) {
      ribbon.suit(scene.radius, scene.ground);
      paint();
    },
    state(state) {
      if (app.travel.isPast) return ribbon.showUntil(state.at);
      if (state.resets !== resets) ribbon.clear();
      resets = state.resets;
      const scene = app.scene.value;
      const root = scene?.links.findIndex((link) => link.name === scene.root) ?? -1;
      if (app.about.value?.mode !== "view" && root >= 0) ribbon.add(state.at, state.poses[root * 7] ?? 0, state.poses[root * 7 + 1] ?? 0);
      ribbon.showUntil(Infinity);
    },
    dispose() {
      ribbon.mesh.geometry.dispose();
      ribbon.mesh.material.dispose();
    },
  };
};

/** A ribbon on the floor, the oldest half forgotten when it is full. */
class Ribbon {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly positions = new BufferAttribute(new Float32Array(MOST * 6), 3);
  /** x and y in m, and when the robot came there, in s along the timeline. */
  private points: [number, number, number][] = [];
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

  add(at: number, x: number, y: number): void {
    const last = this.points.at(-1);
    if (last !== undefined && Math.hypot(x - last[0], y - last[1]) < this.spacing) return;
    if (this.points.length >= MOST) {
      this.points = this.points.slice(MOST / 2);
      this.points.forEach((_, i) => this.write(i));
    }
    this.points.push([x, y, at]);
    this.write(this.points.length - 1);
    if (this.points.length > 1) this.write(this.points.length - 2);
    this.positions.needsUpdate = true;
  }

  /** Draws the way up to a moment. */
  showUntil(at: number): void {
    let [low, high] = [0, this.points.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.points[middle]![2] <= at) low = middle + 1;
      else high = middle;
    }
    this.mesh.geometry.setDrawRange(0, Math.max(0, low - 1) * 6);
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
