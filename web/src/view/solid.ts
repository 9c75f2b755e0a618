import {
  BufferGeometry,
  Color,
  DoubleSide,
  EdgesGeometry,
  FrontSide,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshStandardMaterial,
  Object3D,
  Texture,
} from "three";

import type { Shape } from "../protocol";
import { mesh, type MeshPart } from "./meshes";
import { primitive } from "./shapes";

/** Angle in degrees between two faces above which the edge between them is drawn. */
const EDGE_ANGLE = 30;
/** Colours of a mesh without a colour of its own, and of one with a texture. */
const PLAIN = [0.72, 0.74, 0.78, 1];
const WHITE = [1, 1, 1, 1];

/** How a shape is painted. */
export interface Paint {
  material: (rgba: readonly number[]) => MeshStandardMaterial;
  edges: LineBasicMaterial | null;
}

/** Creates the object of a shape at its pose. Meshes load later. `arrived` is called for each mesh object. */
export function solid(shape: Shape, paint: Paint, arrived: (mesh: Mesh) => void): Object3D {
  const holder = new Group();
  place(holder, shape.position, shape.quaternion);
  if (shape.kind === "mesh") {
    const [x = 1, y = 1, z = 1] = shape.size;
    holder.scale.set(x, y, z);
    holder.updateMatrix();
    void mesh(shape.mesh).then((parts) => {
      for (const part of parts) {
        const [rgba, texture] = colourOf(shape, part);
        const material = paint.material(rgba);
        material.map = texture;
        add(holder, part.geometry, material, null, arrived);
      }
    });
    return holder;
  }
  add(
    holder,
    primitive(shape),
    paint.material(shape.rgba),
    shape.kind === "sphere" ? null : paint.edges,
    arrived,
  );
  return holder;
}

/** The colour and texture of a part of a mesh. The description's colour overrides both. */
export function colourOf(shape: Shape, part: MeshPart): [readonly number[], Texture | null] {
  const hasColour = (shape.rgba[0] ?? 0) >= 0;
  if (hasColour) return [shape.rgba, null];
  return part.texture === null ? [part.rgba ?? PLAIN, null] : [WHITE, part.texture];
}

/** Sets the pose of an object. */
export function place(object: Object3D, position: readonly number[], quaternion: readonly number[]): void {
  object.position.fromArray(position);
  object.quaternion.fromArray(quaternion);
  freezeMatrices(object);
}

/** Sets the pose of an object from the numbers at index `at` of a state's flat poses. */
export function placeAt(object: Object3D, poses: readonly number[], at: number): void {
  object.position.fromArray(poses, at);
  object.quaternion.fromArray(poses, at + 3);
  freezeMatrices(object);
}

/** Computes the matrices of objects once, instead of in each frame. */
export function freezeMatrices(...objects: Object3D[]): void {
  for (const object of objects) {
    object.matrixAutoUpdate = false;
    object.updateMatrix();
  }
}

/** A surface material with an sRGB colour in 0..1, as in URDF. */
export function surface(rgba: readonly number[]): MeshStandardMaterial {
  const [r = 1, g = 1, b = 1, a = 1] = rgba;
  return new MeshStandardMaterial({
    color: new Color().setRGB(r, g, b, "srgb"),
    roughness: 0.62,
    metalness: 0.05,
    transparent: a < 1,
    opacity: a,
    depthWrite: a >= 1,
    side: a < 1 ? DoubleSide : FrontSide,
  });
}

const outlined = new WeakMap<BufferGeometry, EdgesGeometry>();

/** The edges of a geometry, computed once. */
export function edgesOf(geometry: BufferGeometry): EdgesGeometry {
  let edges = outlined.get(geometry);
  if (edges === undefined) {
    edges = new EdgesGeometry(geometry, EDGE_ANGLE);
    outlined.set(geometry, edges);
  }
  return edges;
}

function add(
  holder: Object3D,
  geometry: BufferGeometry,
  material: MeshStandardMaterial,
  edges: LineBasicMaterial | null,
  arrived: (mesh: Mesh) => void,
): void {
  const object = new Mesh(geometry, material);
  object.castShadow = object.receiveShadow = !material.transparent;
  holder.add(object);
  if (edges !== null) holder.add(new LineSegments(edgesOf(geometry), edges));
  freezeMatrices(...holder.children);
  arrived(object);
}
