import { Matrix4, Mesh, Object3D, Plane, Raycaster, Vector2, Vector3 } from "three";

import type { View } from "../view/view";

/** A point on a surface in world coordinates, and its link or body. Both are empty on the ground. */
export interface Place {
  point: Vector3;
  link: string;
  body: string;
}

const UP = new Vector3(0, 0, 1);

/** Finds the surface at a point of the page. */
export class Picker {
  private readonly ray = new Raycaster();

  constructor(private readonly view: View) {}

  /** The nearest surface at a point of the page in CSS pixels, null for the sky. */
  at(x: number, y: number): Place | null {
    const scene = this.view.app.scene.value;
    if (scene === null) return null;
    this.aim(x, y);
    const worldFromPicture = this.worldFromPicture();
    const onRobot = this.view.robot === null ? [] : this.ray.intersectObject(this.view.robot.group, true);
    const hit = onRobot.find(({ object }) => object instanceof Mesh && isSeen(object));
    this.ray.ray.applyMatrix4(worldFromPicture);
    const ground = this.ray.ray.intersectPlane(new Plane(UP, -scene.ground), new Vector3());
    const thing = this.view.bodies?.nearest(this.ray) ?? null;
    const hits: [number, Place][] = [];
    if (hit !== undefined)
      hits.push([
        hit.distance,
        { point: hit.point.clone().applyMatrix4(worldFromPicture), link: this.linkOf(hit.object), body: "" },
      ]);
    if (thing !== null)
      hits.push([
        thing.distance,
        { point: thing.point, link: "", body: scene.bodies[thing.number - scene.links.length]?.name ?? "" },
      ]);
    if (ground !== null)
      hits.push([ground.distanceTo(this.ray.ray.origin), { point: ground, link: "", body: "" }]);
    return hits.sort(([a], [b]) => a - b)[0]?.[1] ?? null;
  }

  /** The point of a horizontal plane at a point of the page, null above the horizon. */
  level(x: number, y: number, height: number): Vector3 | null {
    this.aim(x, y);
    this.ray.ray.applyMatrix4(this.worldFromPicture());
    return this.ray.ray.intersectPlane(new Plane(UP, -height), new Vector3());
  }

  /** Transform from the coordinates of the view, those of the fixed frame, to world coordinates. */
  worldFromPicture(): Matrix4 {
    return this.view.transforms.lookup(this.view.fixedFrame, null) ?? new Matrix4();
  }

  private aim(x: number, y: number): void {
    const { camera, renderer, scene } = this.view.stage;
    const box = renderer.domElement.getBoundingClientRect();
    camera.updateMatrixWorld();
    scene.updateMatrixWorld();
    this.ray.setFromCamera(
      new Vector2(((x - box.left) / box.width) * 2 - 1, 1 - ((y - box.top) / box.height) * 2),
      camera,
    );
    this.ray.params.Line.threshold = 0;
  }

  private linkOf(object: Object3D): string {
    for (let at: Object3D | null = object; at !== null; at = at.parent) {
      const link = this.view.robot?.links.find(({ group }) => group === at);
      if (link !== undefined) return link.view.name;
    }
    return "";
  }
}

function isSeen(object: Object3D): boolean {
  for (let at: Object3D | null = object; at !== null; at = at.parent) if (!at.visible) return false;
  return true;
}
