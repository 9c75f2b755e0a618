import {
  DataTexture,
  Group,
  Mesh,
  MeshBasicMaterial,
  NearestFilter,
  PlaneGeometry,
  SRGBColorSpace,
  Vector3,
} from "three";

import type * as msg from "../messages";
import type { TopicMessage } from "../protocol";
import type { Make } from "./display";
import { placeAtHeader, seconds } from "./frames";
import { poseMatrix } from "./pose-shapes";

type Rgba = readonly [number, number, number, number];

/** rviz's colour schemes, by cell value: 0 is free, 100 occupied, -1 unknown. */
export const SCHEMES: Record<string, (value: number) => Rgba> = {
  map: (value) => {
    if (value < 0 || value > 100) return [112, 137, 134, 255];
    const grey = 255 - Math.round((255 * value) / 100);
    return [grey, grey, grey, 255];
  },
  costmap: (value) => {
    if (value === 0) return [0, 0, 0, 0];
    if (value < 0 || value > 100) return [112, 137, 134, 255];
    if (value === 99) return [0, 255, 255, 255];
    if (value === 100) return [255, 0, 255, 255];
    const red = Math.round((255 * value) / 100);
    return [red, 0, 255 - red, 255];
  },
  raw: (value) => {
    const grey = value & 255;
    return [grey, grey, grey, 255];
  },
};

/** Shader code that moves the map to the far plane, behind everything else. */
const AT_THE_BACK = `
  #ifdef BEHIND
    gl_Position.z = gl_Position.w * 0.999999;
  #endif`;

/** Map: an OccupancyGrid, whose first row lies along the x axis of its origin. */
export const map: Make = (picture) => {
  const group = new Group();
  const material = new MeshBasicMaterial({
    transparent: true,
    depthWrite: false,
    toneMapped: false,
    polygonOffset: true,
    polygonOffsetFactor: -1,
    polygonOffsetUnits: -1,
  });
  material.onBeforeCompile = (shader) =>
    (shader.vertexShader = shader.vertexShader.replace(
      "#include <project_vertex>",
      `#include <project_vertex>${AT_THE_BACK}`,
    ));
  const mesh = new Mesh(new PlaneGeometry(1, 1).translate(0.5, 0.5, 0), material);
  mesh.visible = mesh.matrixAutoUpdate = false;
  mesh.renderOrder = -1;
  group.add(mesh);
  let current: msg.OccupancyGrid | null = null;
  let updates = "";
  let stop = (): void => undefined;
  let scheme = "map";
  const draw = (): void => {
    mesh.visible = current !== null;
    if (current === null) return;
    const { width, height, resolution, origin } = current.info;
    const table = Array.from({ length: 256 }, (_, byte) => SCHEMES[scheme]!(byte > 127 ? byte - 256 : byte));
    const pixels = new Uint8Array(width * height * 4);
    current.data.forEach((value, cell) => pixels.set(table[value & 255]!, cell * 4));
    material.map?.dispose();
    material.map = new DataTexture(pixels, width, height);
    material.map.colorSpace = SRGBColorSpace;
    material.map.magFilter = material.map.minFilter = NearestFilter;
    material.map.needsUpdate = true;
    material.needsUpdate = true;
    poseMatrix(origin, mesh.matrix).scale(new Vector3(width * resolution, height * resolution, 1));
    mesh.matrixWorldNeedsUpdate = true;
  };
  /** Applies an OccupancyGridUpdate, unless it is older than the map. */
  const update = ({ message }: TopicMessage): void => {
    const part = message as unknown as msg.OccupancyGridUpdate;
    if (current === null || seconds(part.header.stamp) < seconds(current.header.stamp)) return;
    const { width, height } = current.info;
    if (
      part.x < 0 ||
      part.y < 0 ||
      part.x + part.width > width ||
      part.y + part.height > height ||
      part.data.length !== part.width * part.height
    )
      return;
    for (let row = 0; row < part.height; row += 1)
      current.data.set(
        part.data.subarray(row * part.width, (row + 1) * part.width),
        (part.y + row) * width + part.x,
      );
    draw();
    picture.invalidate();
  };
  const subscribeUpdates = (topic: string): void => {
    if (topic === updates) return;
    stop();
    updates = topic;
    stop = picture.app.topics.subscribe(topic, update);
  };
  return {
    group,
    configure(values) {
      material.opacity = values["alpha"] as number;
      material.defines = values["behind"] === true ? { BEHIND: "" } : {};
      material.needsUpdate = true;
      if (values["scheme"] === scheme) return;
      scheme = values["scheme"] as string;
      draw();
    },
    message({ topic, message }) {
      const received = message as unknown as msg.OccupancyGrid;
      const grid = { ...received, data: received.data.slice() }; // other displays get the same message, and updates change this copy
      const { width, height } = grid.info;
      if (width * height !== grid.data.length)
        return { level: "error", reason: `${width} by ${height} cells, but ${grid.data.length} values` };
      if (width * height === 0) return { level: "warn", reason: "the map has no cells" };
      if (!(grid.info.resolution > 0))
        return { level: "error", reason: `the resolution is ${grid.info.resolution} m per cell` };
      current = grid;
      draw();
      subscribeUpdates(`${topic}_updates`);
      return placeAtHeader(picture, group, grid.header);
    },
    clear() {
      stop();
      [current, updates, stop] = [null, "", () => undefined];
      draw();
    },
    dispose() {
      stop();
      material.map?.dispose();
      material.dispose();
      mesh.geometry.dispose();
    },
  };
};
