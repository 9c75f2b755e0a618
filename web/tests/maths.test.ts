import { Matrix4, PerspectiveCamera, Quaternion, Vector3, Vector4 } from "three";
import { describe, expect, it } from "vitest";

import { wrap, yawOf } from "../src/angles";
import { symmetricEigen } from "../src/displays/covariance";
import { gridLines } from "../src/displays/grid";
import { Pinhole } from "../src/displays/pinhole";
import { poseMatrix } from "../src/displays/pose-shapes";
import type { CameraInfo } from "../src/messages";
import { measured } from "../src/tools/measure";
import { turn } from "../src/view/keyboard";
import { sized } from "../src/view/shapes";
import { sideOf } from "../src/view/sides";

describe("wrap", () => {
  it.each([
    [0, 0],
    [Math.PI / 2, Math.PI / 2],
    [1.5 * Math.PI, -0.5 * Math.PI],
    [-1.5 * Math.PI, 0.5 * Math.PI],
    [2 * Math.PI, 0],
    [7 * Math.PI + 0.25, -Math.PI + 0.25],
  ])("maps %f rad to %f rad", (angle, expected) => {
    expect(wrap(angle)).toBeCloseTo(expected, 12);
  });

  it.each([Math.PI, -Math.PI, 3 * Math.PI, -3 * Math.PI])("maps the rear, %f rad, to pi", (angle) => {
    expect(wrap(angle)).toBe(Math.PI);
  });
});

describe("yawOf", () => {
  it("is twice the angle whose sine and cosine a rotation about z holds", () => {
    expect(yawOf([0, 0, Math.sin(0.4), Math.cos(0.4)])).toBeCloseTo(0.8, 12);
  });

  it("does not change with roll and pitch after it", () => {
    const turned = new Quaternion()
      .setFromAxisAngle(new Vector3(0, 0, 1), 1.1)
      .multiply(new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), 0.3))
      .multiply(new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), -0.7));
    expect(yawOf(turned.toArray())).toBeCloseTo(1.1, 12);
  });

  it("takes missing numbers as no rotation", () => {
    expect(yawOf([])).toBe(0);
  });
});

describe("poseMatrix", () => {
  it("turns by the quaternion, then moves", () => {
    const half = Math.SQRT1_2; // a quarter turn about z
    const matrix = poseMatrix({
      position: { x: 1, y: 2, z: 3 },
      orientation: { x: 0, y: 0, z: half, w: half },
    });
    const point = new Vector3(1, 0, 0).applyMatrix4(matrix);
    expect(point.x).toBeCloseTo(1, 12);
    expect(point.y).toBeCloseTo(3, 12);
    expect(point.z).toBeCloseTo(3, 12);
  });

  it("takes a quaternion of zeros as no rotation", () => {
    const matrix = poseMatrix({ position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 0 } });
    expect(matrix.equals(new Matrix4())).toBe(true);
  });

  it("normalizes a quaternion", () => {
    const matrix = poseMatrix({ position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 5 } });
    expect(matrix.determinant()).toBeCloseTo(1, 12);
  });
});

describe("symmetricEigen", () => {
  it("returns the diagonal of a diagonal matrix", () => {
    const { values } = symmetricEigen([
      [4, 0, 0],
      [0, 9, 0],
      [0, 0, 1],
    ]);
    expect(values).toEqual([4, 9, 1]);
  });

  it("finds the eigenvalues 1 and 3 of [[2, 1], [1, 2]]", () => {
    const { values } = symmetricEigen([
      [2, 1, 0],
      [1, 2, 0],
      [0, 0, 5],
    ]);
    expect([...values].sort((a, b) => a - b).map((value) => Number(value.toFixed(9)))).toEqual([1, 3, 5]);
  });

  it("returns vectors that the matrix only stretches", () => {
    const matrix = [
      [2, 0.3, 0.1],
      [0.3, 1, 0.2],
      [0.1, 0.2, 3],
    ];
    const { values, vectors } = symmetricEigen(matrix);
    values.forEach((value, index) => {
      const { x, y, z } = vectors[index]!;
      const [a, b, c] = matrix.map((row) => row[0]! * x + row[1]! * y + row[2]! * z);
      expect(a).toBeCloseTo(value * x, 9);
      expect(b).toBeCloseTo(value * y, 9);
      expect(c).toBeCloseTo(value * z, 9);
    });
  });

  it("returns right-handed vectors", () => {
    const [a, b, c] = symmetricEigen([
      [2, 0.3, 0.1],
      [0.3, 1, 0.2],
      [0.1, 0.2, 3],
    ]).vectors;
    expect(a!.clone().cross(b!).dot(c!)).toBeCloseTo(1, 9);
  });
});

describe("Pinhole", () => {
  const info = {
    width: 640,
    height: 480,
    p: [500, 0, 300, 0, 0, 400, 200, 0, 0, 0, 1, 0],
  } as unknown as CameraInfo;

  /** The pixel of a point in the optical frame, by the camera under test. */
  function pixel(pinhole: Pinhole, x: number, y: number, z: number): [number, number] {
    const eye = new Vector4(x, y, z, 1).applyMatrix4(pinhole.eye.matrix.clone().invert());
    const clip = eye.applyMatrix4(pinhole.eye.projectionMatrix);
    return [((clip.x / clip.w + 1) / 2) * 640, ((1 - clip.y / clip.w) / 2) * 480];
  }

  it("projects by u = fx x / z + cx and v = fy y / z + cy", () => {
    const pinhole = new Pinhole();
    expect(pinhole.see(info, 1, 100)).toBe(true);
    const [u, v] = pixel(pinhole, 0.2, -0.3, 2);
    expect(u).toBeCloseTo(500 * 0.1 + 300, 6);
    expect(v).toBeCloseTo(400 * -0.15 + 200, 6);
  });

  it("sees the second camera of a stereo pair from beside the frame", () => {
    const pinhole = new Pinhole();
    const tx = -500 * 0.12; // Tx = -fx * baseline: sensor_msgs/CameraInfo
    pinhole.see({ ...info, p: [500, 0, 320, tx, 0, 400, 240, 0, 0, 0, 1, 0] }, 1, 100);
    expect(pixel(pinhole, 0.12, 0, 2)[0]).toBeCloseTo(320, 6);
  });

  it("refuses intrinsics without a focal length", () => {
    expect(new Pinhole().see({ ...info, p: [0, 0, 320, 0, 0, 0, 240, 0, 0, 0, 1, 0] }, 1, 100)).toBe(false);
  });
});

describe("measured", () => {
  const [a, b, c] = [new Vector3(0, 0, 0), new Vector3(3, 4, 0), new Vector3(3, 4, 2)];

  it("measures nothing with one point", () => {
    expect(measured([a], 1)).toEqual([]);
  });

  it("measures the distance of two points at their middle", () => {
    const [found] = measured([a, b], 2);
    expect(found!.text).toBe("5.000 m");
    expect(found!.place.toArray()).toEqual([1.5, 2, 0]);
    expect(found!.moves).toBe(false);
  });

  it("measures the angle at the second of three points", () => {
    expect(measured([a, b, c], 3).map(({ text }) => text)).toEqual(["5.000 m", "2.000 m", "90.0°"]);
  });

  it("marks what still follows the pointer", () => {
    expect(measured([a, b, c], 2).map(({ moves }) => moves)).toEqual([false, true, true]);
  });
});

describe("turn", () => {
  it("keeps the distance and turns by 5 degrees a press", () => {
    const camera = new PerspectiveCamera();
    camera.position.set(2, 0, 0);
    turn({ camera, controls: { target: new Vector3() } } as unknown as Parameters<typeof turn>[0], 1, 0);
    expect(camera.position.length()).toBeCloseTo(2, 12);
    expect(Math.atan2(camera.position.y, camera.position.x)).toBeCloseTo((5 * Math.PI) / 180, 12);
  });

  it("stops short of straight above", () => {
    const camera = new PerspectiveCamera();
    camera.position.set(1, 0, 100);
    turn({ camera, controls: { target: new Vector3() } } as unknown as Parameters<typeof turn>[0], 0, 1);
    expect(camera.position.x).toBeGreaterThan(0);
  });
});

describe("sideOf", () => {
  it.each([
    ["front", [5, 1, 1], [1, 1, 1]],
    ["side", [1, -4, 1], [1, 1, 1]],
    ["top", [0, 0, 9], [0, 0, 0]],
    ["", [1, 1, 1], [0, 0, 0]],
    ["", [-5, 0, 0], [0, 0, 0]],
  ] as const)("is %j from %j at %j", (side, eye, target) => {
    expect(sideOf(eye, target)).toBe(side);
  });
});

describe("gridLines", () => {
  it("draws no line for no cells", () => {
    expect(gridLines(1, 0, 0)).toEqual([]);
  });

  it("draws count + 1 lines each way around the origin", () => {
    const places = gridLines(0.5, 2, 0);
    expect(places).toHaveLength(2 * 3 * 6); // two ways, three lines, two ends of x, y, z
    expect(Math.max(...places)).toBe(0.5);
    expect(Math.min(...places)).toBe(-0.5);
  });

  it("adds levels and uprights for cells upwards", () => {
    const places = gridLines(1, 1, 1);
    expect(places).toHaveLength(2 * 2 * 2 * 6 + 4 * 6);
    const heights = new Set(places.filter((_, index) => index % 3 === 2));
    expect([...heights].sort((a, b) => a - b)).toEqual([-0.5, 0.5]);
  });
});

describe("sized", () => {
  const shape = (kind: "box" | "cylinder" | "sphere" | "capsule" | "ellipsoid", size: number[]): number[] =>
    sized({ kind, size, position: [], quaternion: [], rgba: [], mesh: "", place: null }).toArray();

  it.each([
    ["box", [1, 2, 3], [1, 2, 3]],
    ["cylinder", [0.1, 0.5], [0.1, 0.1, 0.5]],
    ["sphere", [0.2], [0.2, 0.2, 0.2]],
    ["capsule", [0.1, 0.4], [1, 1, 1]],
    ["ellipsoid", [1, 2, 3], [1, 2, 3]],
  ] as const)("stretches a unit %s of size %j by %j", (kind, size, expected) => {
    expect(shape(kind, [...size])).toEqual(expected);
  });
});
