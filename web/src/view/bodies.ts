import {
  Box3,
  BufferGeometry,
  Group,
  Line3,
  LineBasicMaterial,
  Matrix4,
  Mesh,
  MeshStandardMaterial,
  Object3D,
  Raycaster,
  Sphere,
  Texture,
  Vector3,
} from "three";

import type { BodyView, Scene, Shape, State } from "../protocol";
import { Batch } from "./batches";
import { boxOf, roundness, type Solid } from "./contact-shadows";
import type { IdBuffer } from "./ids";
import { mesh } from "./meshes";
import { sized, unit } from "./shapes";
import { colourOf, place, placeAt, surface } from "./solid";

/** Opacity of a body that hides the robot. */
const FADED = 0.16;
/** With more bodies than this, no edges are drawn, because they would hide each other, and no contact shadows, which would
 * cost too much in software rendering. */
const MOST_IN_DETAIL = 200;

/** Number of directions in which `enclosure` looks. */
const DIRECTIONS = 32;

/** A shape of a body, and the batch that draws it. */
interface Part {
  geometry: BufferGeometry;
  rgba: readonly number[];
  texture: Texture | null;
  /** Transform from part to body coordinates, including the size. */
  local: Matrix4;
  /** The mesh for ray casts. It is in the scene only while the body is faded. */
  probe: Mesh<BufferGeometry, MeshStandardMaterial>;
  batch: Batch | null;
  slot: number;
  round: Solid["round"];
}

interface Body {
  number: number;
  object: Object3D;
  parts: Part[];
  /** Bounding sphere in the body's frame. */
  around: Sphere;
  /** Bounding sphere in the world. */
  place: Sphere;
  faded: boolean;
}

/** The bodies of the world. Moving ones follow the state, and those that hide the robot are faded. */
export class Bodies {
  readonly group = new Group();
  private readonly bodies: Body[];
  private readonly moving: Body[] = [];
  private readonly faded = new Group();
  private readonly edges = new LineBasicMaterial({ transparent: true, opacity: 0.18 });
  private readonly ray = new Raycaster();
  private batches: Batch[] = [];

  constructor(
    scene: Scene,
    private readonly ids: IdBuffer,
    private readonly changed: () => void,
  ) {
    this.group.add(this.faded);
    this.bodies = scene.bodies.map((view, index) => this.body(view, scene.links.length + index));
    this.batchParts();
  }

  setEdges(colour: number): void {
    this.edges.color.set(colour);
  }

  apply(state: State): void {
    this.moving.forEach((body, index) => {
      if (state.bodies.length < (index + 1) * 7) return;
      placeAt(body.object, state.bodies, index * 7);
      this.put(body);
    });
  }

  /** The solids that cast contact shadows: those of bodies that move, or those of all others. */
  *solids(moving: boolean): Generator<Solid> {
    if (this.bodies.length > MOST_IN_DETAIL) return;
    for (const body of this.bodies) {
      if (this.moving.includes(body) !== moving) continue;
      for (const { probe, round } of body.parts)
        yield { matrix: probe.matrix, box: boxOf(probe.geometry), round };
    }
  }

  /** Fades the bodies between the camera and the robot, but not floors and ramps below it. */
  fadeOccluders(eye: Vector3, robot: Vector3, radius: number): void {
    const occluders = new Set<Body>();
    const line = new Line3(eye, robot);
    const nearest = new Vector3();
    const near = this.bodies.filter(({ place }) => {
      const reach = place.radius + radius;
      return (
        line.closestPointToPoint(place.center, true, nearest).distanceToSquared(place.center) < reach * reach
      );
    });
    for (const [x, y] of [
      [0, 0],
      [1, 0],
      [-1, 0],
      [0, 1],
      [0, -1],
    ] as const) {
      const goal = new Vector3(robot.x + x * radius * 0.6, robot.y + y * radius * 0.6, robot.z);
      const way = goal.sub(eye);
      this.ray.set(eye, way.clone().normalize());
      this.ray.far = Math.max(0, way.length() - radius);
      for (const body of near) {
        if (occluders.has(body) || !this.ray.ray.intersectsSphere(body.place)) continue;
        if (
          this.ray.intersectObjects(
            body.parts.map((part) => part.probe),
            false,
          ).length > 0
        )
          occluders.add(body);
      }
    }
    for (const body of this.bodies)
      if (body.faded !== occluders.has(body)) this.fade(body, occluders.has(body));
  }

  /** The nearest body that a ray hits, except faded ones. */
  nearest(ray: Raycaster): { number: number; point: Vector3; distance: number } | null {
    if (!this.group.visible) return null;
    const met = this.bodies.flatMap((body) => {
      if (body.faded || !ray.ray.intersectsSphere(body.place)) return [];
      const [hit] = ray.intersectObjects(
        body.parts.map((part) => part.probe),
        false,
      );
      return hit === undefined ? [] : [{ number: body.number, point: hit.point, distance: hit.distance }];
    });
    return met.sort((a, b) => a.distance - b.distance)[0] ?? null;
  }

  /** The bounding box of a body in the world, by its number. */
  boxOf(number: number): Box3 {
    const body = this.bodies.find((candidate) => candidate.number === number);
    return body === undefined ? new Box3() : boxAround(body);
  }

  /** The bounding box of all bodies that rise above a height. */
  boxAbove(height: number): Box3 {
    const all = new Box3();
    for (const box of this.bodies.map(boxAround)) if (box.max.z > height) all.union(box);
    return all;
  }

  /** The share of the level directions from a point in which a body is closer than `far`. */
  enclosure(from: Vector3, far: number): number {
    const ray = new Raycaster();
    ray.far = far;
    let hits = 0;
    for (let i = 0; i < DIRECTIONS; i += 1) {
      const angle = (2 * Math.PI * i) / DIRECTIONS;
      ray.set(from, new Vector3(Math.cos(angle), Math.sin(angle), 0));
      if (this.nearest(ray) !== null) hits += 1;
    }
    return hits / DIRECTIONS;
  }

  dispose(): void {
    for (const batch of this.batches) {
      this.ids.remove(batch);
      batch.dispose();
    }
    for (const body of this.bodies) for (const part of body.parts) part.probe.material.dispose();
    this.edges.dispose();
    this.group.removeFromParent();
  }

  private body(view: BodyView, number: number): Body {
    const body: Body = {
      number,
      object: new Object3D(),
      parts: [],
      around: new Sphere(new Vector3(), -1),
      place: new Sphere(new Vector3(), -1),
      faded: false,
    };
    place(body.object, view.position, view.quaternion);
    if (view.moving) this.moving.push(body);
    for (const shape of view.parts) {
      if (shape.kind !== "mesh") this.add(body, shape, unit(shape), shape.rgba, null);
      else
        void mesh(shape.mesh).then((parts) => {
          for (const part of parts) this.add(body, shape, part.geometry, ...colourOf(shape, part));
          this.batchParts();
          this.changed();
        });
    }
    return body;
  }

  private add(
    body: Body,
    shape: Shape,
    geometry: BufferGeometry,
    rgba: readonly number[],
    texture: Texture | null,
  ): void {
    const holder = new Object3D();
    place(holder, shape.position, shape.quaternion);
    const local = holder.matrix.clone().scale(sized(shape));
    const probe = new Mesh(geometry, surface(rgba));
    probe.material.map = texture;
    probe.matrixAutoUpdate = false;
    if (geometry.boundingSphere === null) geometry.computeBoundingSphere();
    body.around.union(geometry.boundingSphere!.clone().applyMatrix4(local));
    body.parts.push({ geometry, rgba, texture, local, probe, batch: null, slot: 0, round: roundness(shape) });
  }

  /** Groups parts of equal shape and opacity into batches. */
  private batchParts(): void {
    for (const batch of this.batches) {
      this.ids.remove(batch);
      batch.mesh.removeFromParent();
      batch.lines?.removeFromParent();
      batch.dispose();
    }
    const alike = new Map<string, [Body, Part][]>();
    for (const body of this.bodies) {
      for (const part of body.parts) {
        const key = `${part.geometry.id} ${part.rgba[3] ?? 1} ${part.texture?.id ?? ""}`;
        alike.set(key, [...(alike.get(key) ?? []), [body, part]]);
      }
    }
    this.batches = [...alike.values()].map((members) => this.batch(members));
    for (const body of this.bodies) this.put(body);
  }

  private batch(members: [Body, Part][]): Batch {
    const part = members[0]![1];
    const edged = part.geometry.userData["edged"] === true && this.bodies.length <= MOST_IN_DETAIL;
    const batch = new Batch(
      part.geometry,
      members.map(([body]) => body.number),
      members.map(([, part]) => part.rgba),
      edged ? this.edges : null,
    );
    batch.mesh.material.map = part.texture;
    members.forEach(([, part], slot) => Object.assign(part, { batch, slot }));
    this.group.add(batch.mesh);
    if (batch.lines !== null) this.group.add(batch.lines);
    this.ids.addBatch(batch);
    return batch;
  }

  private put(body: Body): void {
    body.place.copy(body.around).applyMatrix4(body.object.matrix);
    for (const part of body.parts) {
      const { matrixWorld } = part.probe;
      part.probe.matrix.multiplyMatrices(body.object.matrix, part.local);
      matrixWorld.copy(part.probe.matrix);
      if (body.faded) part.batch?.hide(part.slot);
      else part.batch?.put(part.slot, matrixWorld);
    }
  }

  private fade(body: Body, faded: boolean): void {
    body.faded = faded;
    for (const { probe, rgba } of body.parts) {
      probe.material.opacity = faded ? FADED : (rgba[3] ?? 1);
      probe.material.transparent = probe.material.opacity < 1;
      probe.material.depthWrite = !probe.material.transparent;
      if (faded) this.faded.add(probe);
      else probe.removeFromParent();
    }
    this.put(body);
  }
}

function boxAround(body: Body): Box3 {
  const box = new Box3();
  for (const { probe } of body.parts)
    box.union(boxOf(probe.geometry).clone().applyMatrix4(probe.matrixWorld));
  return box;
}
