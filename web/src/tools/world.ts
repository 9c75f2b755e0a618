import { Vector3 } from "three";

import { yawOf } from "../angles";
import type { App } from "../app";
import { h } from "../dom";
import { letGo } from "../focus";
import type { View } from "../view/view";
import { Arrow } from "./arrow";
import { robotPose } from "./poses";
import type { Tool } from "./tool";

/** Milliseconds between two positions that are sent during a drag. */
const EVERY = 50;
const SIZES = [
  ["Length", "0.1"],
  ["Width", "0.1"],
  ["Height", "0.1"],
] as const;

/** Adds the selected object at the point that is clicked. */
export function addTool(app: App, view: View): Tool {
  const arrow = new Arrow(view);
  const what = h("select", { "aria-label": "What to add" });
  const sizes = SIZES.map(([label, value]) =>
    h("input", {
      type: "number",
      min: 0.01,
      max: 10,
      step: 0.01,
      value,
      title: `${label} in m`,
      "aria-label": `${label} in m`,
    }),
  );
  const size = h(
    "span",
    { class: "size" },
    ...sizes.flatMap((field, index) => [index > 0 && "×", field]),
    "m",
  );
  const options = h("span", { class: "tool-options" }, what, size);
  what.addEventListener("change", () => {
    size.hidden = what.value !== "box";
    letGo(what);
  });
  app.about.watch((about) => {
    if (about === null || what.childElementCount === about.things.length) return;
    what.replaceChildren(
      ...about.things.map((name) => h("option", { value: name }, name.replaceAll("_", " "))),
    );
    size.hidden = what.value !== "box";
  });
  const edge = (index: number): number => Math.min(10, Math.max(0.01, sizes[index]!.valueAsNumber || 0.1));
  return {
    name: "add",
    label: "Add to the world",
    key: "b",
    image: "plus",
    hint: "Click the position and drag to set the heading.",
    simulated: true,
    options,
    press: ({ point }) => {
      arrow.begin(point);
      return true;
    },
    drag: (point) => arrow.drag(point),
    release: () => {
      const { x, y, z } = arrow.start;
      app.send({
        type: "spawn",
        what: what.value,
        x,
        y,
        z,
        yaw: arrow.end(0),
        length: edge(0),
        width: edge(1),
        height: edge(2),
      });
      return false;
    },
    cancel: () => arrow.hide(),
  };
}

/** Drags the robot or a movable object to another position. */
export function moveTool(app: App): Tool {
  let name = "";
  let yaw = 0;
  let sent = 0;
  const [from, grabbed, now] = [new Vector3(), new Vector3(), new Vector3()];
  const send = (): void => {
    sent = performance.now();
    const { x, y, z } = from.clone().add(now).sub(grabbed);
    app.send({ type: "move_model", name, x, y, z, yaw });
  };
  return {
    name: "move",
    label: "Move",
    key: "v",
    image: "move",
    hint: "Drag the robot or a movable object to another position.",
    simulated: true,
    press: ({ point, link, body }) => {
      const pose = link === "" ? movingPose(app, body) : robotPose(app);
      if (pose === null) {
        if (body !== "") app.refused.set({ reason: `${body} is static and cannot be moved.` });
        return false;
      }
      name = link === "" ? body : (app.scene.value?.robot ?? "");
      yaw = pose.yaw;
      from.copy(pose.place);
      grabbed.copy(point);
      now.copy(point);
      return true;
    },
    drag: (point) => {
      now.copy(point);
      if (performance.now() - sent > EVERY) send();
    },
    release: () => {
      if (now.distanceTo(grabbed) > 0) send();
      return false;
    },
  };
}

/** Pose of a movable body; for a link of another robot, the pose of that robot's root. */
function movingPose(app: App, body: string): { place: Vector3; yaw: number } | null {
  const owner = body.includes("/") ? body.slice(0, body.indexOf("/") + 1) : body;
  const moving = (app.scene.value?.bodies ?? []).filter((candidate) => candidate.moving);
  const at = moving.findIndex((moved) =>
    owner.endsWith("/") ? moved.name.startsWith(owner) : moved.name === owner,
  );
  const numbers = app.state.value?.bodies as number[] | undefined;
  if (body === "" || at < 0 || numbers === undefined || numbers.length < (at + 1) * 7) return null;
  return {
    place: new Vector3().fromArray(numbers, at * 7),
    yaw: yawOf(numbers.slice(at * 7 + 3, at * 7 + 7)),
  };
}
