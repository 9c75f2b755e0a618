import type { Make } from "./display";
import { grid } from "./grid";
import { laserScan, pointCloud } from "./points";
import { robotModel } from "./robot-model";
import { tf } from "./tf";
import { trail } from "./trail";
import { world } from "./world";

/** The constructor of each kind of display. The code of less common kinds is loaded on first use. */
export const MAKERS: Readonly<Record<string, () => Make | Promise<Make>>> = {
  Grid: () => grid,
  RobotModel: () => robotModel,
  TF: () => tf,
  Trail: () => trail,
  World: () => world,
  LaserScan: () => laserScan,
  PointCloud2: () => pointCloud,
  Path: async () => (await import("./path")).path,
  Odometry: async () => (await import("./poses")).odometry,
  Pose: async () => (await import("./poses")).latestPose,
  PoseWithCovariance: async () => (await import("./poses")).latestPose,
  PoseArray: async () => (await import("./poses")).latestPose,
  Twist: async () => (await import("./twist")).twist,
  Wrench: async () => (await import("./twist")).twist,
  Polygon: async () => (await import("./path")).polygon,
  Map: async () => (await import("./map")).map,
  Marker: async () => (await import("./markers")).markers,
  MarkerArray: async () => (await import("./markers")).markers,
  Contacts: async () => (await import("./markers")).contacts,
  Image: async () => (await import("./image")).image,
  Camera: async () => (await import("./camera")).camera,
  Range: async () => (await import("./range")).range,
  Axes: async () => (await import("./axes")).axes,
  PointStamped: async () => (await import("./axes")).pointStamped,
};
