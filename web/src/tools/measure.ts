import { BufferGeometry, Group, Line, LineBasicMaterial, Points, PointsMaterial, Vector3 } from "three";

import { h } from "../dom";
import type { View } from "../view/view";
import type { Tool } from "./tool";

const COLOUR = 0xff9f1c;
const DOT = 9;
const MOST = 3;

/** A distance or an angle, and the point of the world that its label is at. */
interface Measure {
  text: string;
  place: Vector3;
  /** Whether one of its points still follows the pointer. */
  moves: boolean;
}

/** The distances between up to three points, and the angle at the second; the first `fixed` points are set. */
export function measured(points: readonly Vector3[], fixed: number): Measure[] {
  const [a, b, c] = points;
  const measures: Measure[] = [];
  if (a && b)
    measures.push({ text: metres(a.distanceTo(b)), place: a.clone().lerp(b, 0.5), moves: fixed < 2 });
  if (b && c)
    measures.push({ text: metres(b.distanceTo(c)), place: b.clone().lerp(c, 0.5), moves: fixed < 3 });
  if (a && b && c) {
    const angle = a.clone().sub(b).angleTo(c.clone().sub(b));
    measures.push({ text: `${((angle * 180) / Math.PI).toFixed(1)}°`, place: b, moves: fixed < 3 });
  }
  return measures;
}

/** Measures the distance of two points on surfaces and, with a third point, the angle at the second. */
export function measureTool(view: View, pictureFromWorld: (point: Vector3) => Vector3): Tool {
  const points: Vector3[] = [];
  const line = new Line(
    new BufferGeometry(),
    new LineBasicMaterial({ color: COLOUR, depthTest: false, transparent: true }),
  );
  const dots = new Points(
    line.geometry,
    new PointsMaterial({
      color: COLOUR,
      size: DOT,
      sizeAttenuation: false,
      depthTest: false,
      transparent: true,
    }),
  );
  const drawn = new Group();
  drawn.add(line, dots);
  for (const object of [line, dots]) {
    object.frustumCulled = false;
    object.renderOrder = 21;
  }
  drawn.visible = false;
  view.marks.add(drawn);
  const labels = h("div", { class: "measures", role: "status" });
  view.overlay.after(labels);
  let at: Vector3[] = [];
  /** The point under the pointer, which is not set yet. */
  let over: Vector3 | null = null;

  const show = (): void => {
    const all = over === null || points.length === 0 || points.length === MOST ? points : [...points, over];
    line.geometry.dispose();
    line.geometry = dots.geometry = new BufferGeometry().setFromPoints(all);
    drawn.visible = all.length > 0;
    const measures = measured(all, points.length);
    at = measures.map(({ place }) => place);
    // screen readers announce a measure only once it is fixed
    labels.replaceChildren(
      ...measures.map(({ text, moves }) =>
        h("span", { class: moves ? "measure moving" : "measure", "aria-hidden": String(moves) }, text),
      ),
    );
    view.invalidate();
  };
  view.stage.onFrame(() => {
    const { camera, size } = view.stage;
    at.forEach((place, index) => {
      const projected = pictureFromWorld(place).project(camera);
      const label = labels.children[index] as HTMLElement;
      label.style.transform = `translate(${((projected.x + 1) / 2) * size.x}px, ${((1 - projected.y) / 2) * size.y}px) translate(-50%, -130%)`;
    });
  });
  const clear = (): void => {
    points.length = 0;
    over = null;
    show();
  };
  return {
    name: "measure",
    label: "Measure",
    key: "m",
    image: "ruler",
    hint: "Click two points for the distance, a third for the angle. Escape undoes one.",
    simulated: false,
    press: ({ point }) => {
      if (points.length === MOST) points.length = 0;
      points.push(point.clone());
      over = null;
      show();
      return true;
    },
    release: () => false,
    hover: (place) => {
      over = place?.point ?? null;
      if (points.length > 0 && points.length < MOST) show();
    },
    back: () => {
      if (points.pop() === undefined) return false;
      show();
      return true;
    },
    leave: clear,
  };
}

function metres(distance: number): string {
  return `${distance.toFixed(3)} m`;
}
