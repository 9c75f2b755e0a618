import { Quaternion, Vector3 } from "three";

import { yawOf } from "../angles";
import type { App } from "../app";
import type { View } from "../view/view";
import { Arrow } from "./arrow";
import { GOING, onGoal } from "./goal";
import type { Tool } from "./tool";

const UP = new Vector3(0, 0, 1);

/** A tool that sets a position by a click and a heading by a drag. */
function posed(
  arrow: Arrow,
  about: Omit<Tool, "press" | "drag" | "release" | "cancel">,
  done: (place: Vector3, yaw: number) => boolean,
  heading: (place: Vector3) => number,
): Tool {
  return {
    ...about,
    press: ({ point }) => {
      arrow.begin(point);
      return true;
    },
    drag: (point) => arrow.drag(point),
    release: () => done(arrow.start, arrow.end(heading(arrow.start))),
    cancel: () => arrow.hide(),
  };
}

/** Position and yaw of the robot's root. */
export function robotPose(app: App): { place: Vector3; yaw: number } {
  const { scene, state } = { scene: app.scene.value, state: app.state.value };
  const at = Math.max(0, scene?.links.findIndex((link) => link.name === scene.root) ?? 0) * 7;
  const poses = (state?.poses ?? [0, 0, 0, 0, 0, 0, 1]) as number[];
  return { place: new Vector3().fromArray(poses, at), yaw: yawOf(poses.slice(at + 3, at + 7)) };
}

/** 2D goal. A click without a drag uses the heading from the robot to the goal. */
export function goalTool(app: App, view: View): Tool {
  const arrow = new Arrow(view);
  onGoal(app, (state) => GOING.includes(state) || arrow.hide());
  return posed(
    arrow,
    {
      name: "goal",
      label: "2D goal",
      key: "g",
      image: "goal",
      hint: "Click the goal position and drag to set the heading.",
      simulated: true,
    },
    (place, yaw) => {
      arrow.stay(yaw);
      app.send({
        type: "publish",
        topic: "goal_pose",
        kind: "geometry_msgs/PoseStamped",
        message: { header: header(app), pose: pose(place, yaw) },
      });
      return true;
    },
    (place) => {
      const from = robotPose(app).place;
      return Math.atan2(place.y - from.y, place.x - from.x);
    },
  );
}

/** 2D pose estimate. A simulation moves the robot there. */
export function estimateTool(app: App, view: View): Tool {
  return posed(
    new Arrow(view),
    {
      name: "estimate",
      label: "2D pose estimate",
      key: "e",
      image: "estimate",
      hint: "Click the robot's position and drag to set its heading.",
      simulated: true,
    },
    (place, yaw) => {
      const covariance = Array.from({ length: 36 }, (_, at) => ({ 0: 0.25, 7: 0.25, 35: 0.0685 })[at] ?? 0); // the covariance that rviz sends
      app.send({
        type: "publish",
        topic: "initialpose",
        kind: "geometry_msgs/PoseWithCovarianceStamped",
        message: { header: header(app), pose: { pose: pose(place, yaw), covariance } },
      });
      return true;
    },
    () => robotPose(app).yaw,
  );
}

/** Publishes a point on `clicked_point`. */
export function pointTool(app: App): Tool {
  const clicked = new Vector3();
  return {
    name: "point",
    label: "Publish point",
    key: "u",
    image: "point",
    hint: "Click a surface to publish its point on clicked_point.",
    simulated: true,
    press: ({ point }) => {
      clicked.copy(point);
      return true;
    },
    release: () => {
      app.send({
        type: "publish",
        topic: "clicked_point",
        kind: "geometry_msgs/PointStamped",
        message: { header: header(app), point: xyz(clicked) },
      });
      app.notice.set({
        text: `clicked_point: ${clicked
          .toArray()
          .map((value) => value.toFixed(3))
          .join(", ")} m`,
      });
      return true;
    },
  };
}

/** Moves the view to look at a point. */
export function focusTool(view: View, pictureFromWorld: (point: Vector3) => Vector3): Tool {
  const at = new Vector3();
  return {
    name: "focus",
    label: "Focus",
    key: "c",
    image: "follow",
    hint: "Click a point to look at it.",
    simulated: false,
    press: ({ point }) => {
      at.copy(point);
      return true;
    },
    release: () => {
      const { camera, controls } = view.stage;
      const target = pictureFromWorld(at);
      camera.position.add(target.clone().sub(controls.target));
      view.stage.lookAt(target);
      return true;
    },
  };
}

function header(app: App): object {
  const nanoseconds = Math.round((app.state.value?.time ?? 0) * 1e9);
  return {
    stamp: { sec: Math.floor(nanoseconds / 1e9), nanosec: nanoseconds % 1e9 },
    frame_id: app.scene.value?.world ?? "",
  };
}

function pose(place: Vector3, yaw: number): object {
  const { x, y, z, w } = new Quaternion().setFromAxisAngle(UP, yaw);
  return { position: xyz(new Vector3(place.x, place.y, 0)), orientation: { x, y, z, w } };
}

function xyz({ x, y, z }: Vector3): object {
  return { x, y, z };
}
