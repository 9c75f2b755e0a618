import { Group } from "three";

import type { Make } from "./display";

/** Which of the robot's parts are seen. */
export const robotModel: Make = (picture) => {
  let parts = { visual: false, collision: false, inertia: false };
  return {
    group: new Group(),
    configure(values, shown) {
      parts = {
        visual: shown && values["visual"] === true,
        collision: shown && values["collision"] === true,
        inertia: shown && values["inertia"] === true,
      };
      picture.robot?.show(parts);
    },
    rebuild: () => picture.robot?.show(parts),
    dispose: () => picture.robot?.show({ visual: false, collision: false, inertia: false }),
  };
};
