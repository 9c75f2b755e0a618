import { BufferGeometry, Group, Line, LineBasicMaterial, Points, PointsMaterial, Vector3 } from "three";

import { h } from "../dom";
import type { View } from "../view/view";
import type { Tool } from "./tool";

const COLOUR = 0xff9f1c;
const DOT = 9;

/** The distance of two places on surfaces, and with a third the angle at the second. */
export function measureTool(view: View, pictureFromWorld: (point: Vector3) => Vector3): Tool {
  const points: Vector3[] = [];
  const line = new Line(new BufferGeometry(), new LineBasicMaterial({ color: COLOUR, depthTest: false, transparent: true }));
  const dots = new Points(line.geometry, new PointsMaterial({ color: COLOUR, size: DOT, sizeAttenuation: false, depthTest: false, transparent: true }));
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

  const show = (): void => {
    line.geometry.dispose();
    line.geometry = dots.geometry = new BufferGeometry().setFromPoints(points);
    drawn.visible = points.length > 0;
    const [a, b, c] = points;
    const found: [string, Vector3][] = [];
    if (a && b) found.push([metres(a.distanceTo(b)), a.clone().lerp(b, 0.5)]);
    if (b && c) found.push([metres(b.distanceTo(c)), b.clone().lerp(c, 0.5)]);
    if (a && b && c) found.push([`${((a.clone().sub(b).angleTo(c.clone().sub(b)) * 180) / Math.PI).toFixed(1)}°`, b]);
    at = found.map(([, place]) => place);
    labels.replaceChildren(...found.map(([text]) => h("span", { class: "measure" }, text)));
    view.invalidate();
  };
  view.stage.onFrame(() => {
    const { camera, renderer } = view.stage;
    const { clientWidth, clientHeight } = renderer.domElement;
    at.forEach((place, index) => {
      const seen = pictureFromWorld(place).project(camera);
      const label = labels.children[index] as HTMLElement;
      label.style.transform = `translate(${((seen.x + 1) / 2) * clientWidth}px, ${((1 - seen.y) / 2) * clientHeight}px) translate(-50%, -130%)`;
    });
  });
  const clear = (): void => {
    points.length = 0;
    show();
  };
  return {
    name: "measure",
    label: "Measure",
    key: "m",
    image: "ruler",
    hint: "Click two places for their distance, a third for the angle.",
    simulated: false,
    press: ({ point }) => {
      if (points.length === 3) points.length = 0;
      points.push(point.clone());
      show();
      return true;
    },
    release: () => false,
    leave: clear,
  };
}

function metres(distance: number): string {
  return `${distance.toFixed(3)} m`;
}
