import { Group, LineBasicMaterial, Mesh, MeshStandardMaterial, Raycaster, Vector3, type Object3D } from "three";

import type { Scene, State } from "../protocol";
import type { IdBuffer } from "./ids";
import { place, placeAt, solid, surface } from "./solid";

const FADED = 0.16;

/** One thing in the world. */
interface Body {
  object: Object3D;
  meshes: Mesh<Mesh["geometry"], MeshStandardMaterial>[];
  faded: boolean;
}

/** The things in the world; moving ones stand where the last state says, and none hides the robot. */
export class Bodies {
  readonly group = new Group();
  private readonly bodies: Body[] = [];
  private readonly moving: Object3D[] = [];
  private readonly edges = new LineBasicMaterial({ transparent: true, opacity: 0.18 });
  private readonly ray = new Raycaster();

  constructor(scene: Scene, ids: IdBuffer, changed: () => void) {
    scene.bodies.forEach((view, index) => {
      const body: Body = { object: new Group(), meshes: [], faded: false };
      place(body.object, view.position, view.quaternion);
      for (const part of view.parts) {
        body.object.add(
          solid(part, { material: surface, edges: this.edges }, (mesh) => {
            body.meshes.push(mesh as Body["meshes"][number]);
            ids.add(mesh, scene.links.length + index, () => !body.faded);
            changed();
          }),
        );
      }
      if (view.moving) this.moving.push(body.object);
      this.bodies.push(body);
      this.group.add(body.object);
    });
  }

  setEdges(colour: number): void {
    this.edges.color.set(colour);
  }

  apply(state: State): void {
    this.moving.forEach((object, index) => {
      if (state.bodies.length >= (index + 1) * 7) placeAt(object, state.bodies, index * 7);
    });
  }

  /** Lets the eye see the robot through what stands between them; floors and ramps beneath it stay. */
  clearTheWay(eye: Vector3, robot: Vector3, radius: number): void {
    const wanted = new Set<Body>();
    for (const [x, y] of [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
      const goal = new Vector3(robot.x + x * radius * 0.6, robot.y + y * radius * 0.6, robot.z);
      const way = goal.clone().sub(eye);
      this.ray.set(eye, way.clone().normalize());
      this.ray.far = Math.max(0, way.length() - radius);
      for (const body of this.bodies) if (this.ray.intersectObjects(body.meshes, false).length > 0) wanted.add(body);
    }
    for (const body of this.bodies) if (body.faded !== wanted.has(body)) this.fade(body, wanted.has(body));
  }

  private fade(body: Body, faded: boolean): void {
    body.faded = faded;
    for (const { material } of body.meshes) {
      material.userData["opacity"] ??= material.opacity;
      material.opacity = faded ? FADED : (material.userData["opacity"] as number);
      material.transparent = material.opacity < 1;
      material.depthWrite = !material.transparent;
      material.needsUpdate = true;
    }
  }
}
