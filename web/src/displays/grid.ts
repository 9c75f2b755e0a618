import { Group } from "three";

import type { Make } from "./display";

/** The lines on the floor, which the floor itself draws. */
export const grid: Make = ({ ground }) => ({
  group: new Group(),
  configure: (values, shown) => ground.rule(shown, values["cell"] as number, values["colour"] as string),
  dispose: () => ground.rule(false, 0, ""),
});
