import { Matrix4, Quaternion, Vector3 } from "three";
import { beforeEach, describe, expect, it } from "vitest";

import { poses, applyMimics, type Hinge, type Kinematics } from "../src/offline/kinematics";
import { Replies } from "../src/offline/replies";
import { clampToLimits, type Saved } from "../src/offline/saved";
import type { FromServer, Scene, State } from "../src/protocol";
import { Signal } from "../src/signal";
import { Transforms } from "../src/view/transforms";
import { appOf, IDENTITY_POSE, joint, link, scene, state } from "./fakes";

const AT_ORIGIN = IDENTITY_POSE;

/** Two links of 1 m that turn about z, as an arm in the plane. */
function arm(changes: Partial<Hinge> = {}): Kinematics {
  const hinge = (parent: number, x: number, index: number): Hinge => ({
    parent,
    origin: [x, 0, 0, 0, 0, 0, 1],
    joint: index,
    axis: [0, 0, 1],
    slides: false,
  });
  return {
    hinges: [
      { ...hinge(-1, 0, -1), origin: AT_ORIGIN },
      hinge(0, 0, 0),
      { ...hinge(1, 1, 1), ...changes },
      { ...hinge(2, 1, -1) },
    ],
    follows: [],
    order: [0, 1, 2, 3],
  };
}

function tip(kinematics: Kinematics, positions: number[]): number[] {
  return poses(kinematics, positions).slice(-7, -4);
}

describe("poses", () => {
  it("of an arm follow the law of cosines", () => {
    const [a, b] = [0.3, 0.9];
    const [x, y, z] = tip(arm(), [a, b]);
    expect(x).toBeCloseTo(Math.cos(a) + Math.cos(a + b), 12);
    expect(y).toBeCloseTo(Math.sin(a) + Math.sin(a + b), 12);
    expect(z).toBe(0);
  });

  it("hold unit quaternions of the summed angles", () => {
    const flat = poses(arm(), [0.3, 0.9]);
    expect(flat.slice(-2)[0]).toBeCloseTo(Math.sin(0.6), 12);
    expect(flat.slice(-2)[1]).toBeCloseTo(Math.cos(0.6), 12);
  });

  it("turn about axes that the joints before have turned", () => {
    const quarter = Math.PI / 2;
    // the first joint turns y to -x, so the second, about its own y, lowers the tip towards -z about the world's -x
    const [x, y, z] = tip(arm({ axis: [0, 1, 0] }), [quarter, quarter]);
    expect(x).toBeCloseTo(0, 12);
    expect(y).toBeCloseTo(1, 12);
    expect(z).toBeCloseTo(-1, 12);
    const turned = new Quaternion().fromArray(poses(arm({ axis: [0, 1, 0] }), [quarter, quarter]), 24);
    const side = new Vector3(0, 1, 0).applyQuaternion(turned);
    expect(side.x).toBeCloseTo(-1, 12);
  });

  it("of a sliding joint move along its axis in the joint's frame", () => {
    const half = Math.SQRT1_2; // the joint's frame is a quarter turn about z: its x is the parent's y
    const sliding = arm({ slides: true, axis: [1, 0, 0], origin: [1, 0, 0, 0, 0, half, half] });
    const [x, y] = poses(sliding, [0, 0.25]).slice(14, 16);
    expect(x).toBeCloseTo(1, 12);
    expect(y).toBeCloseTo(0.25, 12);
  });
});

describe("applyMimics", () => {
  it("sets a joint that mimics another by multiplier and offset", () => {
    const follows = [{ joint: 1, leader: 0, multiplier: -2, offset: 0.5 }];
    expect(applyMimics({ ...arm(), follows }, [0.25, 9])).toEqual([0.25, 0]);
  });
});

describe("clampToLimits", () => {
  it("keeps a position within the limits", () => {
    expect([clampToLimits(joint(), -5), clampToLimits(joint(), 2), clampToLimits(joint(), 5)]).toEqual([
      -1, 2, 3,
    ]);
  });

  it("lets a continuous joint turn on", () => {
    expect(clampToLimits(joint({ kind: "continuous" }), 50)).toBe(50);
  });
});

describe("Replies", () => {
  let received: FromServer[] = [];
  const view = scene({
    links: [link("base"), link("upper", "base"), link("fore", "upper"), link("hand", "fore")],
    joints: [joint({ name: "shoulder" }), joint({ name: "elbow" })],
  });

  async function repliesOf(states: readonly State[]): Promise<Replies> {
    received = [];
    const saved: Saved = {
      greeting: [view, state({ positions: [0, 0], poses: poses(arm(), [0, 0]) })],
      sources: [],
      meshes: {},
      kinematics: arm(),
      licences: "",
      states,
    };
    const replies = new Replies((message) => received.push(message), saved);
    await Promise.resolve();
    return replies;
  }

  const last = (): State => received.findLast((message) => message.type === "state")!;

  it("moves a joint within its limits, and the links with it", async () => {
    const replies = await repliesOf([]);
    replies.send({ type: "set_joint", name: "shoulder", position: 9 });
    expect(last().positions).toEqual([3, 0]);
    expect(last().poses.slice(-7, -6)[0]).toBeCloseTo(2 * Math.cos(3), 9);
  });

  it("sets all joints to the middle of their range", async () => {
    const replies = await repliesOf([]);
    replies.send({ type: "set_joints", preset: "centre" });
    expect(last().positions).toEqual([1, 1]);
  });

  it("starts with the last recorded moment", async () => {
    await repliesOf([1, 2, 3].map((time) => state({ time })));
    expect(last().time).toBe(3);
  });

  it("counts a jump back as a reset, so that the trail starts again", async () => {
    const replies = await repliesOf([1, 2, 3].map((time) => state({ time })));
    replies.show(0);
    expect(last()).toMatchObject({ time: 1, resets: 1 });
  });
});

describe("Transforms", () => {
  const states = new Signal<State | null>(null);
  const scenes = new Signal<Scene | null>(null);
  let transforms: Transforms;

  beforeEach(() => {
    states.set(null);
    scenes.set(scene({ links: [link("base_link"), link("wheel", "base_link")] }));
    transforms = new Transforms(appOf({ scene: scenes, state: states }));
  });

  /** A state in which the wheel is at x and turned about z. */
  function moment(
    time: number,
    x: number,
    yaw: number,
    frames: string[][] = [],
    framePoses: number[] = [],
  ): State {
    const turned = [x, 0, 0, 0, 0, Math.sin(yaw / 2), Math.cos(yaw / 2)];
    return state({ time, poses: [...IDENTITY_POSE, ...turned], frames, frame_poses: framePoses });
  }

  it("interpolate place and rotation between two states", () => {
    states.set(moment(1, 0, 0));
    states.set(moment(2, 4, Math.PI / 2));
    const found = transforms.lookup("wheel", 1.25)!;
    const turn = new Quaternion().setFromRotationMatrix(found);
    expect(new Vector3().setFromMatrixPosition(found).x).toBeCloseTo(1, 12);
    expect(2 * Math.atan2(turn.z, turn.w)).toBeCloseTo(Math.PI / 8, 12);
  });

  it("have the newest pose without a time, and beyond the newest state", () => {
    states.set(moment(1, 0, 0));
    states.set(moment(2, 4, 0));
    for (const time of [null, 99])
      expect(new Vector3().setFromMatrixPosition(transforms.lookup("wheel", time)!).x).toBe(4);
  });

  it("are the identity for the world", () => {
    expect(transforms.lookup("odom", null)!.equals(new Matrix4())).toBe(true);
  });

  it("ignore a slash before a name", () => {
    states.set(moment(1, 3, 0));
    expect(transforms.lookup("/wheel", null)).not.toBeNull();
  });

  it("are null for a frame that does not exist", () => {
    states.set(moment(1, 3, 0));
    expect(transforms.lookup("gripper", null)).toBeNull();
  });

  it("know the frames that programs publish, and their parents", () => {
    states.set(moment(1, 0, 0, [["camera", "wheel"]], [0, 7, 0, 0, 0, 0, 1]));
    expect(transforms.names).toEqual(["base_link", "wheel", "camera"]);
    expect(transforms.parent("camera")).toBe("wheel");
    expect(transforms.parent("wheel")).toBe("base_link");
    expect(new Vector3().setFromMatrixPosition(transforms.lookup("camera", null)!).y).toBe(7);
  });

  it("forget the states before a reset", () => {
    states.set(moment(5, 4, 0));
    states.set({ ...moment(0.1, 1, 0), resets: 1 });
    expect(new Vector3().setFromMatrixPosition(transforms.lookup("wheel", 4)!).x).toBe(1);
  });
});
