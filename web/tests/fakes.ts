/** Messages of the server with ordinary values, for tests that care about some of their fields. */

import type { App } from "../src/app";
import type { JointView, LinkView, Scene, State, Timeline } from "../src/protocol";
import { Signal } from "../src/signal";

export const IDENTITY_POSE = [0, 0, 0, 0, 0, 0, 1] as const;

export function state(fields: Partial<State> = {}): State {
  return {
    type: "state",
    revision: 1,
    time: 0,
    paused: false,
    speed: 1,
    rate: 1,
    positions: [],
    poses: [],
    bodies: [],
    frames: [],
    frame_poses: [],
    command: [0, 0],
    twist: [0, 0],
    odometry: [0, 0, 0],
    driver: 0,
    resets: 0,
    at: 0,
    faults: [],
    fallen: [],
    jumps: 0,
    previous_at: 0,
    ...fields,
  };
}

export function link(name: string, parent = ""): LinkView {
  return { name, parent, joint: "", visuals: [], collisions: [], inertia: null, place: null };
}

export function joint(fields: Partial<JointView> = {}): JointView {
  return {
    name: "elbow",
    kind: "revolute",
    child: "forearm",
    axis: [0, 0, 1],
    lower: -1,
    upper: 3,
    mimics: "",
    control: "position",
    speed: 1,
    place: null,
    ...fields,
  };
}

export function scene(fields: Partial<Scene> = {}): Scene {
  return {
    type: "scene",
    revision: 1,
    robot: "kbot",
    root: "base_link",
    world: "odom",
    links: [link("base_link")],
    joints: [],
    bodies: [],
    ground: 0,
    radius: 0.1,
    centre: [0, 0, 0],
    ...fields,
  };
}

export function timeline(fields: Partial<Timeline> = {}): Timeline {
  return {
    type: "timeline",
    start: 0,
    end: 10,
    at: 10,
    live: true,
    played: false,
    loop: false,
    paused: false,
    speed: 1,
    silent: [],
    recording: null,
    asked: null,
    ...fields,
  };
}

/** The parts of an `App` that a class under test reads. */
export function appOf(parts: Record<string, unknown>): App {
  return { scene: new Signal(null), state: new Signal(null), ...parts } as unknown as App;
}
