import {
  Box3,
  BufferGeometry,
  Group,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Matrix4,
  Mesh,
  PlaneGeometry,
  ShaderMaterial,
  Vector3,
} from "three";

import type { Shape } from "../protocol";

/** A solid above the floor: the transform to world coordinates of its box, which includes its size. */
export interface Solid {
  readonly matrix: Matrix4;
  readonly box: Box3;
  /** Whether it is round about the z axis of its box, as a cylinder is, or about all axes, as a ball is. */
  readonly round: "" | "z" | "all";
}

// `at` is in m from the middle of the footprint, along its sides.
const VERTEX = /* glsl */ `
  attribute vec4 foot; // x, y, cosine and sine of the yaw
  attribute vec3 size; // half length, half width, radius of the corners
  attribute vec2 soft; // half width of the edge, strength
  varying vec2 at;
  varying vec2 straight, edge;
  varying float strength;
  void main() {
    at = position.xy * (size.xy + soft.x);
    straight = size.xy - size.z;
    edge = size.z + vec2(-soft.x, soft.x);
    strength = soft.y;
    vec2 turned = vec2(foot.z * at.x - foot.w * at.y, foot.w * at.x + foot.z * at.y);
    gl_Position = projectionMatrix * modelViewMatrix * vec4(foot.xy + turned, 0.0, 1.0);
  }`;
const FRAGMENT = /* glsl */ `
  uniform float darkness;
  varying vec2 at;
  varying vec2 straight, edge;
  varying float strength;
  void main() {
    float away = length(max(abs(at) - straight, 0.0));
    gl_FragColor = vec4(0.0, 0.0, 0.0, darkness * strength * (1.0 - smoothstep(edge.x, edge.y, away)));
  }`;

/** The attributes, with their numbers per shadow, and the sum of these. */
const ATTRIBUTES = [
  ["foot", 4],
  ["size", 3],
  ["soft", 2],
] as const;
const NUMBERS = 9;
/** Half width of a shadow's edge, as a part of the solid's height: as under a ceiling lamp that appears 33 degrees wide. */
const SOFTNESS = 0.3;
/** A weaker shadow is not drawn: it changes the colour of the floor by less than 5 of 255 levels. */
const LEAST = 0.04;
/** |cosine| between the axis of a cylinder and the vertical above which the cylinder stands upright. */
const UPRIGHT = 0.95;

/** Soft dark footprints on the floor below solids that stand on it or are close to it. They are cheap enough for software
 * rendering, and show where an object touches the floor. */
export class ContactShadows {
  readonly group = new Group();
  private readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  /** Height of the floor in m. */
  private ground = 0;
  /** Limit of the edge's half width in m. */
  private softest = 0.05;
  private still: readonly number[] = [];

  constructor() {
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: { darkness: { value: 0 } }, // set by the theme before the first frame
      transparent: true,
      depthWrite: false,
      // above the floor, which has 64, and below everything else that lies on it; 16 units hide errors of rounding
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 48,
    });
    const geometry = new InstancedBufferGeometry();
    const plane = new PlaneGeometry(2, 2);
    geometry.setAttribute("position", plane.getAttribute("position"));
    geometry.setIndex(plane.getIndex());
    geometry.instanceCount = 0;
    this.mesh = new Mesh(geometry, material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = -2; // the first of the transparent objects
    this.group.add(this.mesh);
  }

  setDarkness(darkness: number): void {
    this.mesh.material.uniforms["darkness"]!.value = darkness;
  }

  /** Sets the height of the floor, and the radius of the robot, which limits the width of the edges. */
  fitTo(radius: number, ground: number): void {
    this.ground = this.mesh.position.z = ground;
    this.softest = radius * 0.5;
  }

  /** Sets the solids that do not move. */
  setStill(solids: Iterable<Solid>): void {
    this.still = this.shadowsOf(solids);
  }

  /** Sets the solids that move, and draws the shadows of all. */
  setMoving(solids: Iterable<Solid>): void {
    const all = [...this.still, ...this.shadowsOf(solids)];
    const { geometry } = this.mesh;
    const count = all.length / NUMBERS;
    const held = geometry.getAttribute("foot") as InstancedBufferAttribute | undefined;
    if (held === undefined || held.count < count) this.allocate(count * 2);
    let at = 0;
    for (const [name, width] of ATTRIBUTES) {
      const attribute = geometry.getAttribute(name) as InstancedBufferAttribute;
      for (let slot = 0; slot < count; slot += 1)
        for (let i = 0; i < width; i += 1) attribute.array[slot * width + i] = all[slot * NUMBERS + at + i]!;
      attribute.needsUpdate = true;
      at += width;
    }
    geometry.instanceCount = count;
    this.mesh.visible = count > 0;
  }

  private allocate(count: number): void {
    const { geometry } = this.mesh;
    geometry.dispose();
    for (const [name, width] of ATTRIBUTES)
      geometry.setAttribute(name, new InstancedBufferAttribute(new Float32Array(count * width), width));
  }

  /** The numbers of the attributes, one solid after the other. */
  private shadowsOf(solids: Iterable<Solid>): number[] {
    const numbers: number[] = [];
    const middle = new Vector3();
    const half = new Vector3();
    const sides = [new Vector3(), new Vector3(), new Vector3()] as const;
    for (const { matrix, box, round } of solids) {
      if (box.isEmpty()) continue;
      box.getCenter(middle).applyMatrix4(matrix);
      box.getSize(half).multiplyScalar(0.5);
      matrix.extractBasis(...sides);
      sides[0].multiplyScalar(half.x);
      sides[1].multiplyScalar(half.y);
      sides[2].multiplyScalar(half.z);
      const high = sides.reduce((sum, side) => sum + Math.abs(side.z), 0);
      const gap = middle.z - high - this.ground;
      const flat = sides.map((side) => Math.hypot(side.x, side.y));
      const longest = sides[flat.indexOf(Math.max(...flat))]!;
      const length = Math.hypot(longest.x, longest.y);
      if (length === 0) continue;
      const [ux, uy] = [longest.x / length, longest.y / length];
      const long = sides.reduce((sum, side) => sum + Math.abs(side.x * ux + side.y * uy), 0);
      const wide = sides.reduce((sum, side) => sum + Math.abs(side.y * ux - side.x * uy), 0);
      const narrow = Math.min(long, wide);
      const strength = 1 - Math.max(0, gap) / (narrow + this.softest);
      if (strength < LEAST || middle.z + high < this.ground) continue;
      const axis = sides[2].z / (sides[2].length() || 1);
      const isRound = round === "all" || (round === "z" && Math.abs(axis) > UPRIGHT);
      const edge = Math.min(this.softest, 2 * high * SOFTNESS) + Math.max(0, gap);
      numbers.push(middle.x, middle.y, ux, uy, long, wide, isRound ? narrow : 0, edge, strength);
    }
    return numbers;
  }
}

/** The bounding box of a geometry, computed once. */
export function boxOf(geometry: BufferGeometry): Box3 {
  if (geometry.boundingBox === null) geometry.computeBoundingBox();
  return geometry.boundingBox!;
}

/** How round the shadow of a shape is. */
export function roundness({ kind }: Shape): Solid["round"] {
  return kind === "cylinder" ? "z" : kind === "box" || kind === "mesh" ? "" : "all";
}
