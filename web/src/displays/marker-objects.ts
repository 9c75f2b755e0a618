import {
  BoxGeometry,
  BufferGeometry,
  CanvasTexture,
  Color,
  ConeGeometry,
  CylinderGeometry,
  DoubleSide,
  Float32BufferAttribute,
  Group,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  Object3D,
  Quaternion,
  SphereGeometry,
  Sprite,
  SpriteMaterial,
  Vector3,
} from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";

import type * as msg from "../messages";
import { mesh as fetchMesh } from "../view/meshes";

const X = new Vector3(1, 0, 0);
const Y = new Vector3(0, 1, 0);

/** Builds the object of a marker in the frame of its pose. The index is the type number of visualization_msgs/Marker. */
export const BUILDERS: readonly ((marker: msg.Marker, changed: () => void) => Object3D)[] = [
  arrow,
  (marker) => solid(marker, new BoxGeometry()),
  (marker) => solid(marker, new SphereGeometry(0.5, 32, 20)),
  (marker) => solid(marker, new CylinderGeometry(0.5, 0.5, 1, 40).rotateX(Math.PI / 2)),
  (marker) =>
    lines(
      marker,
      marker.points.slice(1).flatMap((_, i) => [i, i + 1]),
    ),
  (marker) => lines(marker, marker.points.map((_, i) => i).slice(0, marker.points.length & ~1)),
  (marker) => many(marker, new BoxGeometry(), marker.scale),
  (marker) => many(marker, new SphereGeometry(0.5, 16, 10), marker.scale),
  (marker) => many(marker, new BoxGeometry(), { x: marker.scale.x, y: marker.scale.y, z: marker.scale.x }),
  text,
  resource,
  triangles,
  arrows,
];

function paint(
  { color }: msg.Marker,
  options: { vertexColors?: boolean; side?: typeof DoubleSide } = {},
): MeshLambertMaterial {
  return new MeshLambertMaterial({
    color: colour(color),
    opacity: color.a,
    transparent: color.a < 1,
    depthWrite: color.a >= 1,
    ...options,
  });
}

function colour({ r, g, b }: msg.ColorRGBA): Color {
  return new Color().setRGB(r, g, b, "srgb");
}

function solid(marker: msg.Marker, geometry: BufferGeometry): Object3D {
  const mesh = new Mesh(geometry, paint(marker));
  mesh.scale.set(marker.scale.x, marker.scale.y, marker.scale.z);
  return mesh;
}

/** An arrow along x of the marker's pose, or from its first point to its second. */
function arrow(marker: msg.Marker): Object3D {
  const [from, to] = marker.points;
  const { x, y, z } = marker.scale;
  if (from === undefined || to === undefined)
    return arrowAlong(marker, new Vector3(), X.clone().multiplyScalar(x), y / 2, y, x * 0.23);
  const start = new Vector3(from.x, from.y, from.z);
  const way = new Vector3(to.x, to.y, to.z).sub(start);
  return arrowAlong(marker, start, way, x, y, z || way.length() * 0.23);
}

/** Arrows from each point to the next. */
function arrows(marker: msg.Marker): Object3D {
  const { points } = marker;
  const all = new Group();
  for (const [i, point] of points.slice(1).entries())
    all.add(arrow({ ...marker, points: [points[i]!, point] }));
  return all;
}

function arrowAlong(
  marker: msg.Marker,
  start: Vector3,
  way: Vector3,
  shaft: number,
  head: number,
  headLength: number,
): Object3D {
  const length = way.length();
  const tip = Math.min(headLength, length);
  const parts = [
    new CylinderGeometry(shaft / 2, shaft / 2, length - tip, 20).translate(0, (length - tip) / 2, 0),
    new ConeGeometry(head / 2, tip, 24).translate(0, length - tip / 2, 0),
  ];
  const mesh = new Mesh(mergeGeometries(parts), paint(marker));
  mesh.position.copy(start);
  if (length > 0) mesh.quaternion.setFromUnitVectors(Y, way.normalize());
  return mesh;
}

/** Line segments. `ends` holds the indices of their points, two for each. */
function lines(marker: msg.Marker, ends: readonly number[]): Object3D {
  const hasColours = marker.colors.length === marker.points.length;
  const material = new LineMaterial({
    linewidth: marker.scale.x,
    worldUnits: true,
    vertexColors: hasColours,
    toneMapped: false,
    opacity: marker.color.a,
    transparent: marker.color.a < 1,
  });
  if (!hasColours) material.color = colour(marker.color);
  else Object.assign(material, { opacity: 1, transparent: false });
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions(ends.map((end) => marker.points[end]!).flatMap(({ x, y, z }) => [x, y, z]));
  if (hasColours) geometry.setColors(ends.flatMap((end) => colour(marker.colors[end]!).toArray()));
  const object = new LineSegments2(geometry, material);
  object.frustumCulled = false;
  return object;
}

function many(marker: msg.Marker, geometry: BufferGeometry, size: msg.Vector3): Object3D {
  const material = paint(marker);
  const mesh = new InstancedMesh(geometry, material, marker.points.length);
  const scale = new Vector3(size.x, size.y, size.z);
  const still = new Quaternion();
  const hasColours = marker.colors.length === marker.points.length;
  if (hasColours)
    Object.assign(material, { color: new Color(0xffffff), opacity: 1, transparent: false, depthWrite: true });
  marker.points.forEach((point, index) => {
    mesh.setMatrixAt(index, new Matrix4().compose(new Vector3(point.x, point.y, point.z), still, scale));
    if (hasColours) mesh.setColorAt(index, colour(marker.colors[index]!));
  });
  mesh.frustumCulled = false;
  return mesh;
}

function triangles(marker: msg.Marker): Object3D {
  const whole = marker.points.slice(0, marker.points.length - (marker.points.length % 3));
  const hasColours = marker.colors.length === marker.points.length;
  const geometry = new BufferGeometry();
  geometry.setAttribute(
    "position",
    new Float32BufferAttribute(
      whole.flatMap(({ x, y, z }) => [x, y, z]),
      3,
    ),
  );
  if (hasColours)
    geometry.setAttribute(
      "color",
      new Float32BufferAttribute(
        marker.colors.flatMap((rgba) => colour(rgba).toArray()),
        3,
      ),
    );
  geometry.computeVertexNormals();
  const material = paint(marker, { vertexColors: hasColours, side: DoubleSide });
  if (hasColours) Object.assign(material, { color: new Color(0xffffff), opacity: 1, transparent: false });
  const mesh = new Mesh(geometry, material);
  mesh.scale.set(marker.scale.x, marker.scale.y, marker.scale.z);
  return mesh;
}

/** Text that faces the camera, with upper-case letters `scale.z` m high. */
function text(marker: msg.Marker): Object3D {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d")!;
  const rows = marker.text.split("\n");
  const font = "600 64px Inter, system-ui, sans-serif";
  context.font = font;
  canvas.width = Math.ceil(Math.max(1, ...rows.map((row) => context.measureText(row).width))) + 8;
  canvas.height = 80 * rows.length;
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = `#${colour(marker.color).getHexString()}`;
  rows.forEach((row, index) => context.fillText(row, canvas.width / 2, 80 * index + 42));
  const map = new CanvasTexture(canvas);
  map.colorSpace = "srgb";
  const sprite = new Sprite(
    new SpriteMaterial({
      map,
      opacity: marker.color.a,
      transparent: true,
      depthWrite: false,
      toneMapped: false,
    }),
  );
  // the height of an upper-case letter is 0.73 of the font size
  const perPixel = marker.scale.z / (64 * 0.73);
  sprite.scale.set(canvas.width * perPixel, canvas.height * perPixel, 1);
  return sprite;
}

/** A mesh, by the id that the server serves it under. */
function resource(marker: msg.Marker, changed: () => void): Object3D {
  const group = new Group();
  group.scale.set(marker.scale.x, marker.scale.y, marker.scale.z);
  if (marker.mesh_resource === "") return group;
  void fetchMesh(marker.mesh_resource).then((parts) => {
    for (const part of parts) {
      const material = paint(marker);
      if (marker.mesh_use_embedded_materials && part.rgba !== null) {
        const [r, g, b, a] = part.rgba as [number, number, number, number];
        Object.assign(material, {
          color: new Color().setRGB(r, g, b, "srgb"),
          opacity: a,
          transparent: a < 1,
        });
      }
      const mesh = new Mesh(part.geometry, material);
      mesh.userData["shared"] = true;
      group.add(mesh);
    }
    changed();
  });
  return group;
}
