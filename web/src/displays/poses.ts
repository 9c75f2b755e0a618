import { Group, Matrix4, Quaternion, Vector3 } from "three";

import type * as msg from "../messages";
import { CovarianceShape } from "./covariance";
import type { Display, Make, Picture } from "./display";
import { placeAtHeader } from "./frames";
import { PoseShapes, poseMatrix } from "./pose-shapes";
import type { Status, Values } from "./set";

/** Limit of stored poses if all are to be kept: a page may be open for days. */
const MOST_KEPT = 10_000;

/** A display of poses in the frame of a header. */
abstract class Poses implements Display {
  readonly group = new Group();
  protected readonly shapes = new PoseShapes();
  protected readonly covarianceShape = new CovarianceShape();
  protected values: Values = {};

  constructor(protected readonly picture: Picture) {
    this.covarianceShape.group.visible = false;
    this.group.add(this.shapes.group, this.covarianceShape.group);
  }

  configure(values: Values): void {
    this.values = values;
    this.shapes.style(String(values["shape"]), String(values["colour"]), Number(values["alpha"]));
    this.covarianceShape.style(String(values["colour"]), Number(values["covariance_alpha"] ?? 0));
    this.draw();
  }

  rebuild(): void {
    this.draw();
  }

  abstract message(received: { message: Record<string, unknown> }): Status | null;
  abstract clear(): void;
  protected abstract draw(): void;

  protected get length(): number {
    return Number(this.values["length"]) || this.picture.radius * 1.5;
  }

  dispose(): void {
    this.shapes.dispose();
    this.covarianceShape.dispose();
  }
}

/** Pose, PoseWithCovariance and PoseArray: the latest message. */
class LatestPoses extends Poses {
  private poses: Matrix4[] = [];
  private covariance: readonly number[] | null = null;

  message({ message }: { message: Record<string, unknown> }): Status | null {
    const { pose, poses } = message as { pose?: msg.Pose | msg.PoseWithCovariance; poses?: msg.Pose[] };
    this.covariance = pose !== undefined && "covariance" in pose ? pose.covariance : null;
    const all =
      poses ??
      [pose === undefined ? null : "pose" in pose ? pose.pose : pose].filter((pose) => pose !== null);
    this.poses = all.map((pose) => poseMatrix(pose));
    this.draw();
    return placeAtHeader(this.picture, this.group, message["header"] as msg.Header);
  }

  clear(): void {
    this.poses = [];
    this.covariance = null;
    this.draw();
  }

  protected draw(): void {
    this.shapes.put(this.poses, this.length);
    const isShown = this.values["covariance"] === true && this.covariance !== null;
    this.covarianceShape.group.visible = isShown;
    if (isShown) this.covarianceShape.put(this.covariance!, this.poses[0]!, this.length);
  }
}

/** Odometry: past poses, one each time the robot has moved far enough. */
class OdometryTrail extends Poses {
  private poses: Matrix4[] = [];
  private last: msg.PoseWithCovariance | null = null;

  message({ message }: { message: Record<string, unknown> }): Status | null {
    const odometry = message as unknown as msg.Odometry;
    const now = poseMatrix(odometry.pose.pose);
    const before = this.poses.at(-1);
    if (before === undefined || this.hasMoved(before, now)) {
      this.poses.push(now);
      if (this.poses.length > this.most) this.poses = this.poses.slice(-this.most);
    }
    this.last = odometry.pose;
    this.draw();
    return placeAtHeader(this.picture, this.group, odometry.header);
  }

  state({ resets }: { resets: number }): void {
    if (resets !== this.resets) this.clear();
    this.resets = resets;
  }

  private resets = 0;

  clear(): void {
    this.poses = [];
    this.last = null;
    this.draw();
  }

  private get most(): number {
    return Number(this.values["keep"]) || MOST_KEPT;
  }

  private hasMoved(before: Matrix4, now: Matrix4): boolean {
    const distance = new Vector3()
      .setFromMatrixPosition(before)
      .distanceTo(new Vector3().setFromMatrixPosition(now));
    const angle = new Quaternion()
      .setFromRotationMatrix(before)
      .angleTo(new Quaternion().setFromRotationMatrix(now));
    return distance >= Number(this.values["distance"]) || angle >= Number(this.values["angle"]);
  }

  protected draw(): void {
    this.shapes.put(this.poses.slice(-this.most), this.length);
    const isShown = this.values["covariance"] === true && this.last !== null;
    this.covarianceShape.group.visible = isShown;
    if (isShown) this.covarianceShape.put(this.last!.covariance, poseMatrix(this.last!.pose), this.length);
  }
}

export const latestPose: Make = (picture) => new LatestPoses(picture);
export const odometry: Make = (picture) => new OdometryTrail(picture);
