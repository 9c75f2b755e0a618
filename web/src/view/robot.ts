import { BoxGeometry, Color, EdgesGeometry, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, MeshStandardMaterial, SphereGeometry } from "three";

import type { InertiaView, LinkView, Scene, State } from "../protocol";
import { COLLISION, INERTIA, SELECTED } from "./palette";
import type { IdBuffer } from "./ids";
import { place, placeAt, solid, surface, type Paint } from "./solid";

/** Which of the links' parts are seen. */
export interface Parts {
  visual: boolean;
  collision: boolean;
  inertia: boolean;
}

const EMITTED = new Color(SELECTED);

/** One link's drawn parts. */
class LinkObject {
  readonly group = new Group();
  readonly visual = new Group();
  readonly collision = new Group();
  readonly inertia = new Group();
  private readonly materials: MeshStandardMaterial[] = [];
  private lit = 0;

  constructor(
    readonly view: LinkView,
    index: number,
    ids: IdBuffer,
    edges: LineBasicMaterial,
    changed: () => void,
  ) {
    this.group.add(this.visual, this.collision, this.inertia);
    const paint: Paint = { material: surface, edges };
    for (const shape of view.visuals) {
      this.visual.add(
        solid(shape, paint, (mesh) => {
          const material = mesh.material as MeshStandardMaterial;
          this.materials.push(material);
          this.paintLit(material);
          ids.add(mesh, index, () => this.visual.visible);
          changed();
        }),
      );
    }
    for (const shape of view.collisions) {
      this.collision.add(
        solid(shape, collisionPaint(), (mesh) => {
          mesh.castShadow = mesh.receiveShadow = false;
          mesh.renderOrder = 2;
          ids.add(mesh, index, () => this.collision.visible && !this.visual.visible);
          changed();
        }),
      );
    }
    if (view.inertia !== null) this.inertia.add(...inertiaObjects(view.inertia));
  }

  /** 0 plain, 1 pointed at, 2 chosen. */
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

/** The robot as the scene has it, standing as the last state says. */
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
    this.group.add(...this.links.map((link) => link.group));
  }

  apply(state: State): void {
    this.links.forEach((link, index) => placeAt(link.group, state.poses, index * 7));
  }

  show(options: Parts): void {
    for (const link of this.links) {
      link.visual.visible = options.visual;
      link.collision.visible = options.collision;
      link.inertia.visible = options.inertia;
    }
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
      new MeshStandardMaterial({ color: COLLISION, transparent: true, opacity: 0.28, depthWrite: false, roughness: 1 }),
    edges: new LineBasicMaterial({ color: COLLISION, transparent: true, opacity: 0.8 }),
  };
}

function inertiaObjects(inertia: InertiaView): [Mesh, LineSegments, Mesh] {
  const [x = 0, y = 0, z = 0] = inertia.box;
  const geometry = new BoxGeometry(x, y, z);
  const filling = new MeshBasicMaterial({ color: INERTIA, transparent: true, opacity: 0.22, depthTest: false, depthWrite: false });
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
  for (const object of [box, edges, centre]) {
    place(object, inertia.position, inertia.quaternion);
    object.renderOrder = 5;
  }
  return [box, edges, centre];
}
