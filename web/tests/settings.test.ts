import { beforeEach, describe, expect, it, vi } from "vitest";

import { DisplaySet, kindOf, valuesOf } from "../src/displays/set";
import { stickOf } from "../src/drive-keys";
import { steady } from "../src/gamepad";
import { loadStored, withOption, type Options } from "../src/options";
import { readView, viewHash, type SavedView } from "../src/view/address";

describe("stickOf", () => {
  it.each([
    [["KeyW"], [1, 0]],
    [["ArrowDown"], [-1, 0]],
    [
      ["KeyW", "KeyA"],
      [1, 1],
    ],
    [["ArrowRight"], [0, -1]],
    [
      ["KeyW", "KeyS"],
      [0, 0],
    ],
    [
      ["KeyW", "ArrowUp"],
      [1, 0],
    ],
  ])("of the keys %j is %j", (held, expected) => {
    expect(stickOf([0, 0], held)).toEqual(expected);
  });

  it("adds a pad and keys, up to full", () => {
    expect(stickOf([0.5, -0.25], ["KeyW"])).toEqual([1, -0.25]);
  });
});

describe("steady", () => {
  it("is zero near the middle of a stick", () => {
    expect([steady(0.1), steady(-0.11), steady(0.12), steady(-1)]).toEqual([0, 0, 0.12, -1]);
  });
});

describe("withOption", () => {
  const options: Options = { follow: true, ride: false, flat: true, side: "top", radians: false };

  it("changes one option", () => {
    expect(withOption(options, "radians", true)).toEqual({ ...options, radians: true });
  });

  it("unlocks the side with the perspective, and for a ride", () => {
    expect(withOption(options, "flat", false).side).toBe("");
    expect(withOption(options, "ride", true).side).toBe("");
    expect(withOption(options, "follow", false).side).toBe("top");
  });
});

describe("the view in the address", () => {
  const view: SavedView = {
    eye: [1.25, -2, 0.5],
    target: [0, 0, 0.1],
    orthographic: true,
    ride: false,
    follow: false,
    frame: "arm/tool 1",
  };

  it("is read back as it was written", () => {
    expect(readView(viewHash(view))).toEqual(view);
  });

  it("is written with a name for each option that is on", () => {
    expect(viewHash({ ...view, frame: "" })).toBe("#eye=1.25,-2,0.5&at=0,0,0.1&flat&still");
  });

  it("keeps directions at a small distance", () => {
    const near = { ...view, eye: [0.000123456, 0, 0], target: [0, 0, 0] };
    expect(readView(viewHash(near))!.eye[0]).toBeCloseTo(0.000123456, 9);
  });

  it.each([
    "",
    "#",
    "#eye=1,2,3",
    "#eye=1,2&at=0,0,0",
    "#eye=a,b,c&at=0,0,0",
    "#eye=1,1,1&at=1,1,1",
    "#eye=1e9,0,0&at=0,0,0",
  ])("is null for %j", (hash) => {
    expect(readView(hash)).toBeNull();
  });
});

describe("DisplaySet", () => {
  let displays: DisplaySet;
  const names = (): string[] => displays.all.value.map(({ name }) => name);

  beforeEach(() => {
    const kept = new Map<string, string>();
    vi.stubGlobal("localStorage", {
      getItem: (key: string) => kept.get(key) ?? null,
      setItem: (key: string, value: string) => kept.set(key, value),
    });
    displays = new DisplaySet();
  });

  it("starts with the usual displays", () => {
    expect(names()).toEqual(["Grid", "RobotModel", "TF", "Trail", "World", "LaserScan"]);
  });

  it("gives a second display of a kind a new name", () => {
    displays.add("LaserScan");
    displays.add("LaserScan");
    expect(names().slice(-2)).toEqual(["LaserScan 2", "LaserScan 3"]);
  });

  it("does not add a second display of a single kind", () => {
    const single = displays.all.value.find(({ kind }) => kindOf(kind).single)!;
    expect(displays.add(single.kind)).toBeNull();
  });

  it("gives a second grid cells, because the floor draws the lines of the first", () => {
    expect(displays.add("Grid")!.properties["count"]).toBe(10);
  });

  it("moves a display, but not beyond the ends", () => {
    const [first, second] = displays.all.value;
    displays.move(second!.id, -1);
    displays.move(second!.id, -1);
    expect(displays.all.value.slice(0, 2).map(({ id }) => id)).toEqual([second!.id, first!.id]);
  });

  it("renames a display in the settings of cameras too", () => {
    const camera = displays.add("Camera")!;
    displays.set(camera.id, "Grid/show", false);
    displays.rename(displays.all.value[0]!.id, " Floor ");
    expect(names()[0]).toBe("Floor");
    expect(displays.all.value.at(-1)!.properties).toEqual({ "Floor/show": false });
  });

  it("keeps a name when the new one is empty", () => {
    displays.rename(displays.all.value[0]!.id, "  ");
    expect(names()[0]).toBe("Grid");
  });

  it("turns a property on together with its display", () => {
    const tf = displays.all.value.find(({ kind }) => kind === "TF")!;
    displays.enable(tf.id, false);
    expect(displays.isOn("TF", "axes")).toBe(false);
    displays.turn("TF", "axes", true);
    expect(displays.isOn("TF", "axes")).toBe(true);
  });

  it("adds a display of a kind that is turned on and missing", () => {
    displays.turn("Axes", null, true);
    expect(displays.isOn("Axes", null)).toBe(true);
  });

  it("has the initial values of unset properties", () => {
    const robot = displays.all.value.find(({ kind }) => kind === "RobotModel")!;
    expect(valuesOf(robot)).toMatchObject({ visual: true, collision: false });
    displays.set(robot.id, "collision", true);
    expect(valuesOf(displays.all.value.find(({ id }) => id === robot.id)!)["collision"]).toBe(true);
  });

  it("is stored in the browser", () => {
    displays.remove(displays.all.value[0]!.id);
    displays.setGlobal("light", 2);
    const again = new DisplaySet();
    expect(again.all.value.map(({ name }) => name)).toEqual(names());
    expect(again.global("light")).toBe(2);
  });

  it("starts with the defaults if the browser stored something else", () => {
    localStorage.setItem("kbot.displays", '{"globals": {}, "displays": [{"kind": "Hologram"}]}');
    expect(new DisplaySet().all.value).toHaveLength(6);
  });
});

describe("loadStored", () => {
  it("is null if the storage holds invalid JSON", () => {
    vi.stubGlobal("localStorage", { getItem: () => "{" });
    expect(loadStored("kbot.options")).toBeNull();
    vi.unstubAllGlobals();
  });
});
