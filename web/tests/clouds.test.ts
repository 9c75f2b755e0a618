import { describe, expect, it, vi } from "vitest";

import { readCloud, readScan } from "../src/displays/clouds";
import { linear, shades, viridis } from "../src/displays/colours";
import { SCHEMES } from "../src/displays/map";
import { pixelsOf } from "../src/displays/pixels";
import type { Image } from "../src/messages";
import { unpack } from "../src/view/meshes";

const header = { stamp: { sec: 0, nanosec: 0 }, frame_id: "lidar" };

describe("readScan", () => {
  const scan = {
    header,
    angle_min: 0,
    angle_increment: Math.PI / 2,
    range_min: 0.1,
    range_max: 10,
    ranges: [1, 2, 0.05, Infinity, 3],
    intensities: [7, 8, 9],
  };

  it("puts each beam that returned at its angle and range", () => {
    const { places } = readScan(scan);
    const expected = [1, 0, 0, 0, 2, 0, 3, 0, 0]; // the fifth beam is a full turn on
    expect(places).toHaveLength(9);
    places.forEach((value, index) => expect(value).toBeCloseTo(expected[index]!, 6));
  });

  it("keeps the intensity of each point, 0 if it is missing", () => {
    expect([...readScan(scan).intensity!]).toEqual([7, 8, 0]);
  });
});

/** A cloud of one row: x, y, z as float32, then a uint8 `ring`, then packed colours. */
function cloudOf(
  points: readonly (readonly number[])[],
  changes: Record<string, unknown> = {},
): Record<string, unknown> {
  const step = 20;
  const data = new Uint8Array(step * points.length);
  const view = new DataView(data.buffer);
  points.forEach(([x, y, z, ring, rgb], index) => {
    [x, y, z].forEach((value, axis) => view.setFloat32(index * step + 4 * axis, value!, true));
    view.setUint8(index * step + 12, ring!);
    view.setUint32(index * step + 16, rgb!, true);
  });
  const fields = [
    { name: "x", offset: 0, datatype: 7, count: 1 },
    { name: "y", offset: 4, datatype: 7, count: 1 },
    { name: "z", offset: 8, datatype: 7, count: 1 },
    { name: "ring", offset: 12, datatype: 2, count: 1 },
    { name: "rgb", offset: 16, datatype: 7, count: 1 },
  ];
  return {
    header,
    height: 1,
    width: points.length,
    fields,
    is_bigendian: false,
    point_step: step,
    row_step: step * points.length,
    data,
    is_dense: false,
    ...changes,
  };
}

describe("readCloud", () => {
  const points = [
    [1, 2, 3, 4, 0x00ff8001],
    [NaN, 0, 0, 5, 0],
    [-1, 0.5, 0, 6, 0x000000ff],
  ];

  it("reads places, a channel and colours, and leaves out points that are not finite", () => {
    const cloud = readCloud(cloudOf(points), "ring");
    if ("level" in cloud) throw new Error(cloud.reason);
    expect([...cloud.places]).toEqual([1, 2, 3, -1, 0.5, 0]);
    expect([...cloud.intensity!]).toEqual([4, 6]);
    expect([...cloud.rgb!]).toEqual([255, 128, 1, 0, 0, 255]);
  });

  it("has no intensity where no field has that name", () => {
    const cloud = readCloud(cloudOf(points), "");
    expect("level" in cloud ? cloud : cloud.intensity).toBeNull();
  });

  it("reads an empty cloud", () => {
    const cloud = readCloud(cloudOf([]), "");
    expect("level" in cloud ? cloud : cloud.places).toHaveLength(0);
  });

  it.each([
    ["no z", { fields: [{ name: "x", offset: 0, datatype: 7, count: 1 }] }],
    ["too few bytes", { data: new Uint8Array(30) }],
    ["rows shorter than their points", { height: 2, width: 2, row_step: 20 }],
    ["a field beyond the point", { point_step: 10, row_step: 30 }],
  ])("reports %s", (_, changes) => {
    const cloud = readCloud(cloudOf(points, changes), "");
    expect("level" in cloud && cloud.level).toBe("error");
  });

  it("reports a datatype that does not exist", () => {
    const fields = ["x", "y", "z"].map((name, axis) => ({ name, offset: 4 * axis, datatype: 9, count: 1 }));
    const cloud = readCloud(cloudOf(points, { fields }), "");
    expect("level" in cloud && cloud.reason).toContain("datatype 9");
  });
});

describe("colours", () => {
  it("start and end as viridis does", () => {
    expect(viridis(0)).toEqual([0.267, 0.005, 0.329]);
    expect(viridis(1)).toEqual([0.993, 0.906, 0.144]);
  });

  it("are held at the ends", () => {
    expect(viridis(-3)).toEqual(viridis(0));
    expect(viridis(7)).toEqual(viridis(1));
  });

  it("are mixed between two stops", () => {
    const [red] = viridis(0.125); // halfway from the first stop to the second
    expect(red).toBeCloseTo((0.267 + 0.231) / 2, 12);
  });

  it("are those of the ends for the lowest and the highest value, in linear light", () => {
    const found = shades([2, 4], 2, 4);
    // the sRGB transfer function: ((c + 0.055) / 1.055) ** 2.4
    expect(found[0]).toBeCloseTo(((0.267 + 0.055) / 1.055) ** 2.4, 5);
    expect(found[3]).toBeCloseTo(((0.993 + 0.055) / 1.055) ** 2.4, 5);
  });

  it("are the first one where all values are equal", () => {
    expect([...shades([5], 5, 5)]).toEqual([...shades([0], 0, 1)]);
  });

  it("of bytes are 0 and 1 in linear light at the ends", () => {
    const [black, white] = linear(Uint8Array.from([0, 255]));
    expect(black).toBe(0);
    expect(white).toBeCloseTo(1, 6);
  });
});

describe("the colours of a map", () => {
  it("are rviz's for free, occupied and unknown cells", () => {
    const { map } = SCHEMES;
    expect(map!(0)).toEqual([255, 255, 255, 255]);
    expect(map!(100)).toEqual([0, 0, 0, 255]);
    expect(map!(-1)).toEqual([112, 137, 134, 255]);
  });

  it("of a costmap mark lethal and inscribed cells, and show free ones through", () => {
    const { costmap } = SCHEMES;
    expect(costmap!(0)[3]).toBe(0);
    expect(costmap!(99)).toEqual([0, 255, 255, 255]);
    expect(costmap!(100)).toEqual([255, 0, 255, 255]);
  });
});

describe("pixelsOf", () => {
  vi.stubGlobal(
    "ImageData",
    class {
      readonly data: Uint8ClampedArray;
      constructor(
        readonly width: number,
        readonly height: number,
      ) {
        this.data = new Uint8ClampedArray(4 * width * height);
      }
    },
  );

  function image(encoding: string, step: number, data: Uint8Array, width = 2, height = 1): Image {
    return { header, encoding, step, data, width, height, is_bigendian: 0 };
  }

  function pixels(from: Image, set = {}): number[] {
    const found = pixelsOf(from, set);
    if (!(found instanceof ImageData)) throw new Error(found.reason);
    return [...found.data];
  }

  it("reads rgb8 and skips the padding of its rows", () => {
    const data = Uint8Array.from([1, 2, 3, 4, 5, 6, 99, 99]);
    expect(pixels(image("rgb8", 8, data))).toEqual([1, 2, 3, 255, 4, 5, 6, 255]);
  });

  it("reads bgr8 with blue first", () => {
    expect(pixels(image("bgr8", 6, Uint8Array.from([1, 2, 3, 4, 5, 6])))).toEqual([
      3, 2, 1, 255, 6, 5, 4, 255,
    ]);
  });

  it("reads grey from YUV without colour", () => {
    expect(pixels(image("uyvy", 4, Uint8Array.from([128, 50, 128, 200])))).toEqual([
      50, 50, 50, 255, 200, 200, 200, 255,
    ]);
  });

  it("shows the nearest depth of 16UC1 brightest, and a zero black", () => {
    const data = new Uint8Array(Uint16Array.from([1000, 2000, 0]).buffer);
    const found = pixels(image("16UC1", 6, data, 3), { normalize: true });
    const [red, green, blue] = viridis(1).map((part) => Math.round(part * 255));
    expect(found.slice(0, 3)).toEqual([red, green, blue]);
    expect(found.slice(8)).toEqual([0, 0, 0, 255]);
  });

  it.each([
    ["an unknown encoding", image("jpeg2000", 6, new Uint8Array(6))],
    ["too few bytes", image("rgb8", 6, new Uint8Array(5))],
    ["rows that are too short", image("rgb8", 5, new Uint8Array(6))],
  ])("reports %s", (_, wrong) => {
    expect(pixelsOf(wrong, {})).toMatchObject({ level: "error" });
  });
});

describe("unpack", () => {
  it("reads the head, the vertices and the triangles of a mesh", async () => {
    const head = new TextEncoder().encode(
      JSON.stringify([{ vertices: 3, triangles: 1, rgba: [1, 0, 0, 1], image: 0 }]).padEnd(64),
    );
    const data = new ArrayBuffer(4 + 64 + 9 * 4 + 3 * 4);
    new DataView(data).setUint32(0, 64, true);
    new Uint8Array(data, 4, 64).set(head);
    new Float32Array(data, 68, 9).set([0, 0, 0, 1, 0, 0, 0, 1, 0]);
    new Uint32Array(data, 104, 3).set([0, 1, 2]);
    const [part, ...others] = await unpack(data);
    expect(others).toEqual([]);
    expect(part!.rgba).toEqual([1, 0, 0, 1]);
    expect([...part!.geometry.getIndex()!.array]).toEqual([0, 1, 2]);
    // counterclockwise in the plane z = 0: the normal is +z
    expect(part!.geometry.getAttribute("normal").getZ(0)).toBeCloseTo(1, 6);
  });
});
