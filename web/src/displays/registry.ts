import type { Make } from "./display";
import { grid } from "./grid";
import { laserScan } from "./laser-scan";
import { robotModel } from "./robot-model";
import { tf } from "./tf";
import { trail } from "./trail";

/** What makes a display of each kind; those that are rarely used are loaded when they are first wanted. */
export const MAKERS: Readonly<Record<string, () => Make | Promise<Make>>> = {
  Grid: () => grid,
  RobotModel: () => robotModel,
  TF: () => tf,
  Trail: () => trail,
  LaserScan: () => laserScan,
};
