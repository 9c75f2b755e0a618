import { Vector3 } from "three";

import type { App } from "../app";
import { PushFields } from "../panels/push-fields";
import type { View } from "../view/view";
import { Arrow } from "./arrow";
import type { Tool } from "./tool";

/** Pushes or kicks the object under the pointer in the direction of the drag. A click without a drag pushes it away from
 * the camera. */
export function pushTool(app: App, view: View): Tool {
  const arrow = new Arrow(view);
  const strength = new PushFields(app);
  let [name, isBody] = ["", false];
  return {
    name: "push",
    label: "Push",
    key: "n",
    image: "push",
    hint: "Drag from the robot or an object in the direction to push it.",
    simulated: true,
    options: strength.element,
    press: ({ point, link, body }) => {
      [name, isBody] = [link || body, link === ""];
      if (name === "") return false;
      arrow.begin(point);
      return true;
    },
    drag: (point) => arrow.drag(point),
    release: () => {
      const { camera, controls } = view.stage;
      const away = controls.target.clone().sub(camera.position);
      const yaw = arrow.end(Math.atan2(away.y, away.x));
      strength.give(name, isBody, new Vector3(Math.cos(yaw), Math.sin(yaw), 0));
      return false;
    },
    cancel: () => arrow.hide(),
  };
}
