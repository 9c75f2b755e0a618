import { Group, LineBasicMaterial, type Object3D } from "three";

import type { Scene, State } from "../protocol";
import type { IdBuffer } from "./ids";
import { place, placeAt, solid, surface } from "./solid";

/** The things in the world; moving ones stand where the last state says. */
export class Bodies {
  readonly group = new Group();
  private readonly moving: Object3D[] = [];
  private readonly edges = new LineBasicMaterial({ transparent: true, opacity: 0.18 });

  constructor(scene: Scene, ids: IdBuffer, changed: () => void) {
    scene.bodies.forEach((body, index) => {
      const object = new Group();
      place(object, body.position, body.quaternion);
      for (const part of body.parts) {
        object.add(
          solid(part, { material: surface, edges: this.edges }, (mesh) => {
            ids.add(mesh, scene.links.length + index, () => true);
            changed();
          }),
        );
      }
      if (body.moving) this.moving.push(object);
      this.group.add(object);
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
}
