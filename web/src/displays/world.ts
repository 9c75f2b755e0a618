import { Group } from "three";

import type { Make } from "./display";
import { fallenStatus } from "./fallen";

/** World: the objects in the world. */
export const world: Make = (picture) => {
  let isShown = true;
  const show = (on: boolean): void => {
    if (picture.bodies !== null) picture.bodies.group.visible = on;
  };
  return {
    group: new Group(),
    get beside() {
      return picture.bodies?.group;
    },
    configure(_, shown) {
      isShown = shown;
      show(shown);
    },
    rebuild: () => show(isShown),
    status: () => fallenStatus((picture.app.state.value?.fallen ?? []).filter(({ name }) => name !== "")),
    dispose: () => show(false),
  };
};
