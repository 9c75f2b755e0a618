import {
  BoxGeometry,
  BufferGeometry,
  Color,
  EdgesGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  SphereGeometry,
  type Object3D,
} from "three";

import type { InertiaView, LinkView, Scene, State } from "../protocol";
import { boxOf, roundness, type Solid } from "./contact-shadows";
import { COLLISION, INERTIA, SELECTED } from "./palette";
import type { IdBuffer } from "./ids";
import { freezeMatrices, place, placeAt, solid, surface, type Paint } from "./solid";

/** The visible parts of a link, and their opacity. */
export interface Parts {
  visual: boolean;
  collision: boolean;
  inertia: boolean;
  inertiaShape: "box" | "ellipsoid";
  mass: boolean;
  alpha: number;
}

export const NOTHING: Parts = {
  visual: false,
  collision: false,
  inertia: false,
  inertiaShape: "box",
  mass: false,
  alpha: 1,
};

const EMITTED = new Color(SELECTED);

/** The objects of a link. Collision and inertia objects are created on first use. */
class LinkObject {
  readonly group = new Group();
  readonly visual = new Group();
  readonly collision = new Group();
  readonly inertia = new Group();
  private inertiaParts: InertiaParts | null = null;
  private alpha = 1;
  private readonly materials: MeshStandardMaterial[] = [];
  private lit = 0;

  constructor(
    readonly view: LinkView,
    private readonly index: number,
    private readonly ids: IdBuffer,
    edges: LineBasicMaterial,
    private readonly changed: () => void,
  ) {
    this.group.add(this.visual);
    freezeMatrices(this.visual, this.collision, this.inertia);
    const paint: Paint = { material: surface, edges };
    for (const shape of view.visuals) {
      this.visual.add(
        solid(shape, paint, (mesh) => {
          const material = mesh.material as MeshStandardMaterial;
          this.materials.push(material);
          this.paintLit(material);
          if (this.alpha < 1) this.fade(material);
          ids.add(mesh, index, () => this.visual.visible);
          changed();
        }),
      );
    }
  }

  /** Shows the given parts. */
  show(parts: Parts): void {
    if (parts.collision && this.collision.parent === null) this.makeCollisions();
    if ((parts.inertia || parts.mass) && this.inertiaParts === null) this.makeInertia();
    this.visual.visible = parts.visual;
    this.collision.visible = parts.collision;
    this.inertia.visible = parts.inertia || parts.mass;
    for (const object of this.inertiaParts?.box ?? [])
      object.visible = parts.inertia && parts.inertiaShape === "box";
    for (const object of this.inertiaParts?.ellipsoid ?? [])
      object.visible = parts.inertia && parts.inertiaShape === "ellipsoid";
    if (parts.alpha === this.alpha) return;
    this.alpha = parts.alpha;
    for (const material of this.materials) this.fade(material);
  }

  private makeCollisions(): void {
    this.group.add(this.collision);
    for (const shape of this.view.collisions) {
      this.collision.add(
        solid(shape, collisionPaint(), (mesh) => {
          mesh.castShadow = mesh.receiveShadow = false;
          mesh.renderOrder = 2;
          this.ids.add(mesh, this.index, () => this.collision.visible && !this.visual.visible);
          this.changed();
        }),
      );
    }
  }

  private makeInertia(): void {
    if (this.view.inertia === null) return;
    this.inertiaParts = inertiaObjects(this.view.inertia);
    this.group.add(this.inertia);
    this.inertia.add(...this.inertiaParts.box, ...this.inertiaParts.ellipsoid, this.inertiaParts.centre);
  }

  private fade(material: MeshStandardMaterial): void {
    const own = (material.userData["opacity"] ??= material.opacity) as number;
    material.opacity = own * this.alpha;
    material.transparent = material.opacity < 1;
    material.depthWrite = !material.transparent;
    material.needsUpdate = true;
  }

  /** 0 normal, 1 under the pointer, 2 selected. */
  light(level: number): void {
    if (level === this.lit) return;
    this.lit = level;
    for (const material of this.materials) this.paintLit(material);
  }

  private paintLit(material: MeshStandardMaterial): void {
    material.emissive.copy(EMITTED);
    material.emissiveIntensity = [0, 0.14, 0.62][this.lit] ?? 0;
  }
}

/** The robot of a scene, posed by the last state. */
export class RobotObject {
  readonly group = new Group();
  readonly links: LinkObject[];
  private readonly edges = new LineBasicMaterial({ transparent: true, opacity: 0.22 });
  private pointed = "";
  private selected = "";

  constructor(
    readonly scene: Scene,
    ids: IdBuffer,
    private readonly changed: () => void,
  ) {
    this.links = scene.links.map((view, index) => new LinkObject(view, index, ids, this.edges, changed));
    for (const link of this.links) this.group.add(link.group);
  }

  apply(state: State): void {
    this.links.forEach((link, index) => placeAt(link.group, state.poses, index * 7));
  }

  /** The visible solids, which cast contact shadows. */
  *solids(): Generator<Solid> {
    for (const link of this.links) {
      if (!link.visual.visible) continue;
      for (const [index, holder] of link.visual.children.entries()) {
        for (const mesh of holder.children) {
          if (!(mesh instanceof Mesh)) continue;
          const matrix = new Matrix4()
            .multiplyMatrices(link.group.matrix, holder.matrix)
            .multiply(mesh.matrix);
          yield {
            matrix,
            box: boxOf(mesh.geometry as BufferGeometry),
            round: roundness(link.view.visuals[index]!),
          };
        }
      }
    }
  }

  /** Shows the given parts of each link. */
  show(parts: (link: string) => Parts): void {
    for (const link of this.links) link.show(parts(link.view.name));
  }

  setEdges(colour: number): void {
    this.edges.color.set(colour);
  }

  point(name: string): void {
    if (name === this.pointed) return;
    this.pointed = name;
    this.lightAll();
  }

  select(name: string): void {
    this.selected = name;
    this.lightAll();
  }

  private lightAll(): void {
    for (const link of this.links) {
      link.light(link.view.name === this.selected ? 2 : link.view.name === this.pointed ? 1 : 0);
    }
    this.changed();
  }
}

function collisionPaint(): Paint {
  return {
    material: () =>
      new MeshStandardMaterial({
        color: COLLISION,
        transparent: true,
        opacity: 0.28,
        depthWrite: false,
        roughness: 1,
      }),
    edges: new LineBasicMaterial({ color: COLLISION, transparent: true, opacity: 0.8 }),
  };
}

interface InertiaParts {
  box: Object3D[];
  ellipsoid: Object3D[];
  centre: Object3D;
}

/** A solid ellipsoid has the inertia of the box with sides a: b² + c² = 5 (I / m), where the box has 12 (I / m). */
const HALF_AXIS = Math.sqrt(5 / 12);

function inertiaObjects(inertia: InertiaView): InertiaParts {
  const [x = 0, y = 0, z = 0] = inertia.box;
  const geometry = new BoxGeometry(x, y, z);
  const filling = new MeshBasicMaterial({
    color: INERTIA,
    transparent: true,
    opacity: 0.22,
    depthTest: false,
    depthWrite: false,
  });
  const box = new Mesh(geometry, filling);
  const edges = new LineSegments(
    new EdgesGeometry(geometry),
    new LineBasicMaterial({ color: INERTIA, transparent: true, depthTest: false }),
  );
  const size = Math.max(x, y, z, 1e-4);
  const centre = new Mesh(
    new SphereGeometry(size * 0.06, 20, 14),
    new MeshBasicMaterial({ color: INERTIA, transparent: true, depthTest: false }),
  );
  const ellipsoid = new Mesh(new SphereGeometry(1, 40, 28), filling);
  const rim = new Mesh(
    new SphereGeometry(1, 18, 12),
    new MeshBasicMaterial({
      color: INERTIA,
      wireframe: true,
      transparent: true,
      opacity: 0.25,
      depthTest: false,
    }),
  );
  for (const object of [box, edges, centre, ellipsoid, rim]) {
    place(object, inertia.position, inertia.quaternion);
    object.renderOrder = 5;
  }
  for (const object of [ellipsoid, rim]) {
    object.scale.set(x * HALF_AXIS, y * HALF_AXIS, z * HALF_AXIS);
    object.updateMatrix();
  }
  return { box: [box, edges], ellipsoid: [ellipsoid, rim], centre };
}
