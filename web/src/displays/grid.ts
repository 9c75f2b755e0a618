import { BufferGeometry, Color, Float32BufferAttribute, Group, LineBasicMaterial, LineSegments } from "three";

import { PALETTES } from "../view/palette";
import type { Make } from "./display";
import type { Values } from "./set";

/** Grid: endless lines on the floor, which the floor itself draws, or a number of cells in any frame. */
export const grid: Make = (picture) => {
  const group = new Group();
  const material = new LineBasicMaterial({ transparent: true });
  const segments = new LineSegments(new BufferGeometry(), material);
  segments.frustumCulled = false;
  group.add(segments);
  group.matrixAutoUpdate = false;
  let set: Values = {};
  let isShown = false;
  const setFloorGrid = (): void =>
    picture.ground.setGrid(
      group,
      isShown && Number(set["count"]) === 0,
      Number(set["cell"]),
      String(set["colour"]),
      Number(set["alpha"]),
    );
  const draw = (): void => {
    const [cell, count, colour] = [Number(set["cell"]), Number(set["count"]), String(set["colour"])];
    setFloorGrid();
    material.color = new Color(colour || PALETTES[picture.app.theme.value].majorLine);
    material.opacity = Number(set["alpha"]);
    segments.geometry.dispose();
    segments.geometry = new BufferGeometry();
    const places = gridLines(
      cell || picture.ground.autoCell,
      Math.round(count),
      Math.round(Number(set["normal_count"])),
    );
    segments.visible = places.length > 0;
    segments.geometry.setAttribute("position", new Float32BufferAttribute(places, 3));
    segments.position.set(Number(set["x"]), Number(set["y"]), Number(set["z"]));
    segments.rotation.set(
      set["plane"] === "XZ" ? Math.PI / 2 : 0,
      set["plane"] === "YZ" ? -Math.PI / 2 : 0,
      0,
    );
  };
  return {
    group,
    configure(values, shown) {
      set = values;
      isShown = shown;
      draw();
    },
    rebuild: draw,
    frame() {
      if (Number(set["count"]) === 0) return;
      segments.visible =
        picture.transforms.lookup(String(set["frame"]) || picture.fixedFrame, null, group.matrix) !== null;
      group.matrixWorldNeedsUpdate = true;
    },
    status() {
      const name = String(set["frame"]);
      if (isShown) setFloorGrid(); // called after any display changed: the grid on the floor may have been removed
      if (Number(set["count"]) === 0)
        return picture.ground.isGridOwner(group)
          ? null
          : { level: "warn", reason: "another grid draws the floor lines: set a cell count for this one" };
      return name === "" || picture.transforms.lookup(name, null) !== null
        ? null
        : { level: "error", reason: `frame ${name} does not exist` };
    },
    dispose() {
      picture.ground.setGrid(group, false, 0, "", 1);
      segments.geometry.dispose();
      material.dispose();
    },
  };
};

/** End points of the lines of `count` x `count` x `above` cells around the origin. */
export function gridLines(cell: number, count: number, above: number): number[] {
  const half = (cell * count) / 2;
  const places: number[] = [];
  if (count === 0) return places;
  for (let level = 0; level <= above; level += 1) {
    const z = (level - above / 2) * cell;
    for (let i = 0; i <= count; i += 1) {
      const at = i * cell - half;
      places.push(-half, at, z, half, at, z, at, -half, z, at, half, z);
    }
  }
  if (above === 0) return places;
  const high = (above * cell) / 2;
  for (let i = 0; i <= count; i += 1)
    for (let j = 0; j <= count; j += 1)
      places.push(i * cell - half, j * cell - half, -high, i * cell - half, j * cell - half, high);
  return places;
}
