import { xmlLanguage } from "@codemirror/lang-xml";
import { Text } from "@codemirror/state";
import { describe, expect, it } from "vitest";

import { baseName, rounded } from "../src/dom";
import { fallenStatus } from "../src/displays/fallen";
import { seconds } from "../src/displays/frames";
import { hasGaps } from "../src/displays/gaps";
import { shortType } from "../src/displays/live";
import { matcher } from "../src/displays/tf";
import { runs } from "../src/handle";
import { piecesOf } from "../src/editor/colours";
import { hintText } from "../src/editor/marks";
import { isValue, stepped } from "../src/editor/numbers";
import { timeOf } from "../src/panels/faults";
import { tidy, unitOf } from "../src/panels/joints";
import { formatMass, STEPS } from "../src/panels/links";
import { formatValue, leaves } from "../src/panels/topics";
import { ago, bytes, clock, recordedText } from "../src/time/format";
import { goalText } from "../src/tools/goal";
import { joint } from "./fakes";

describe("clock", () => {
  it.each([
    [0, "0:00.0"],
    [62.5, "1:02.5"],
    [59.96, "1:00.0"],
    [3600, "60:00.0"],
    [-1, "0:00.0"],
  ])("shows %f s as %s", (time, text) => {
    expect(clock(time)).toBe(text);
  });
});

describe("ago", () => {
  it.each([
    [12.34, "12.3 seconds ago"],
    [60, "1 minute 0.0 seconds ago"],
    [125, "2 minutes 5.0 seconds ago"],
  ])("reads %f s as %s", (time, text) => {
    expect(ago(time)).toBe(text);
  });
});

describe("bytes", () => {
  it.each([
    [1499, "1 kB"],
    [2_500_000, "2.5 MB"],
    [3_210_000_000, "3.21 GB"],
  ])("shows %d as %s", (count, text) => {
    expect(bytes(count)).toBe(text);
  });
});

describe("recordedText", () => {
  it("names the command that plays the recording", () => {
    expect(recordedText({ type: "recorded", file: "/tmp/kbot-1.mcap", address: "" })).toContain(
      "kbot view kbot-1.mcap",
    );
  });
});

describe("rounded", () => {
  it("rounds to digits", () => {
    expect(rounded(1.2345, 2)).toBe("1.23");
  });

  it("shows no sign on zero", () => {
    expect(rounded(-0.0004, 3)).toBe("0.000");
    expect(rounded(-0.0006, 3)).toBe("-0.001");
  });
});

describe("baseName", () => {
  it.each([
    ["/home/me/robot.xacro", "robot.xacro"],
    ["C:\\robots\\arm.urdf", "arm.urdf"],
    ["robot.urdf", "robot.urdf"],
  ])("of %s is %s", (path, name) => {
    expect(baseName(path)).toBe(name);
  });
});

describe("formatMass", () => {
  it.each([
    [12.345, "12.3 kg"],
    [1, "1 kg"],
    [0.25, "250 g"],
    [0.00042, "420 mg"],
  ])("shows %f kg as %s", (mass, text) => {
    expect(formatMass(mass)).toBe(text);
  });
});

describe("the units of a joint", () => {
  it.each([
    ["revolute", false, 180 / Math.PI, "°"],
    ["revolute", true, 1, "rad"],
    ["prismatic", false, 1000, "mm"],
    ["prismatic", true, 1, "m"],
  ] as const)("%s, radians %j: factor %f, %s", (kind, radians, factor, sign) => {
    const [found, , unit] = unitOf(joint({ kind }), radians);
    expect([found, unit]).toEqual([factor, sign]);
  });

  it("drops zeros at the end and sets a true minus sign", () => {
    expect(tidy(-1.5, 3)).toBe("\u22121.5");
    expect(tidy(2, 1)).toBe("2");
  });
});

describe("numbers in the source", () => {
  it.each(["1", "-0.5", "+2", ".5", "1.", "1e-3", "${2 * wheel}", "$(arg radius)"])(
    "%s is a value",
    (text) => {
      expect(isValue(text)).toBe(true);
    },
  );

  it.each(["", "abc", "1,5", "0x10", "1e999", "--1", "${", "1 2"])("%j is not a value", (text) => {
    expect(isValue(text)).toBe(false);
  });

  it.each([
    ["0.10", 3, "0.13"],
    ["5", -7, "-2"],
    ["0.05", -5, "0.00"],
    ["1.5", 10, "2.5"],
  ])("%s moved by %d steps of its last digit is %s", (text, steps, expected) => {
    expect(stepped(text, steps)).toBe(expected);
  });

  it("moves a number with an exponent by percent", () => {
    expect(stepped("2e-3", 10)).toBe("0.0022");
  });
});

/** The coloured pieces of a text, each with its style. */
function coloured(text: string): [string, string][] {
  const doc = Text.of(text.split("\n"));
  const pieces = piecesOf(xmlLanguage.parser.parse(text), doc, 0, text.length);
  return pieces.map(({ from, to, style }) => [text.slice(from, to), style]);
}

describe("piecesOf", () => {
  it("colours tags, attributes, numbers and expressions", () => {
    expect(coloured('<mass value="0.5"/>')).toEqual([
      ["<", "t-mark"],
      ["mass", "t-tag"],
      ["value", "t-name"],
      ['"', "t-value"],
      ["0.5", "t-number"],
      ['"', "t-value"],
      ["/>", "t-mark"],
    ]);
  });

  it("distinguishes xacro tags from others", () => {
    expect(coloured("<xacro:if")).toContainEqual(["xacro:if", "t-xacro"]);
  });

  it("marks an expression as a whole", () => {
    expect(coloured('<a b="${2*r} 1"/>')).toContainEqual(["${2*r}", "t-expression"]);
  });

  it("does not mark digits in a name as a number", () => {
    expect(coloured('<a b="link_2"/>').map(([, style]) => style)).not.toContain("t-number");
  });

  it("does not mark the version of XML as a number", () => {
    expect(coloured('<?xml version="1.0"?><a/>').map(([, style]) => style)).not.toContain("t-number");
  });

  it("marks a comment of several lines", () => {
    expect(coloured("<a/><!-- a\nb -->")).toContainEqual(["<!-- a\nb -->", "t-comment"]);
  });
});

describe("hints in the source", () => {
  const place = { file: "a", line: 1, column: 1, length: 1 };

  it("lists the values of all macro calls", () => {
    expect(hintText({ place, values: ["0.1", "0.2"], more: false })).toBe("0.1 | 0.2");
  });

  it("ends with an ellipsis if there are more", () => {
    expect(hintText({ place, values: ["0.1"], more: true })).toBe("0.1 | \u2026");
  });
});

describe("the fields of a message", () => {
  it("are the leaves with their paths", () => {
    expect([...leaves({ header: { frame_id: "odom" }, data: [1, true] }, [])]).toEqual([
      [["header", "frame_id"], "odom"],
      [["data", "0"], 1],
      [["data", "1"], true],
    ]);
  });

  it("show the first 12 entries of a list and the number of the others", () => {
    const found = [...leaves({ list: Array.from({ length: 15 }, (_, index) => index) }, [])];
    expect(found).toHaveLength(13);
    expect(found.at(-1)).toEqual([["list", "…"], "3 more"]);
  });

  it("show an array of numbers by its length", () => {
    expect([...leaves({ ranges: new Float32Array(360) }, [])]).toEqual([[["ranges"], "360 numbers"]]);
  });

  it("show numbers with at most six digits", () => {
    expect(formatValue(1 / 3)).toBe("0.333333");
    expect(formatValue(1200000)).toBe("1200000");
    expect(formatValue(false)).toBe("false");
  });
});

describe("the tree of links", () => {
  // base (1), wheel (2), hub (3), arm (2)
  const levels = [1, 2, 3, 2];

  it.each([
    ["ArrowDown", 0, 1],
    ["ArrowUp", 2, 1],
    ["ArrowLeft", 2, 1],
    ["ArrowLeft", 3, 0],
    ["ArrowRight", 1, 2],
    ["ArrowRight", 2, 2],
    ["Home", 3, 0],
    ["End", 0, 3],
  ])("%s goes from item %d to item %d", (key, from, to) => {
    expect(STEPS[key]!(from, levels)).toBe(to);
  });

  it("has no item above its root", () => {
    expect(STEPS["ArrowLeft"]!(0, levels)).toBe(-1);
  });
});

describe("the time of a fault", () => {
  const fault = { number: 1, words: "", start: 5, stop: 8 };

  it.each([
    [3.5, "in 1.5 s"],
    [6, "2.0 s left"],
    [9, "0.0 s left"],
  ])("at %f s is %s", (time, text) => {
    expect(timeOf(fault, time)).toBe(text);
  });
});

describe("statuses of displays", () => {
  it("name what fell out of the world", () => {
    expect(fallenStatus([])).toBeNull();
    expect(fallenStatus([{ name: "box_1", time: 12.34, z: -80.4 }])).toEqual({
      level: "warn",
      reason: "box_1 fell out of the world at t=12.3 s, z=-80 m now",
    });
  });

  it("show a type without its package", () => {
    expect(shortType("sensor_msgs/msg/LaserScan")).toBe("LaserScan");
  });
});

describe("the filter of frames", () => {
  it("is a regular expression", () => {
    const matches = matcher("^odom$|wheel");
    expect([matches("odom"), matches("left_wheel"), matches("odom_combined")]).toEqual([true, true, false]);
  });

  it("is plain text while the expression is incomplete", () => {
    const matches = matcher("wheel(");
    expect([matches("wheel(1)"), matches("wheel")]).toEqual([true, false]);
  });

  it("matches every name when it is empty", () => {
    expect(matcher("")("anything")).toBe(true);
  });
});

describe("small parts of messages", () => {
  it("stamps are in seconds", () => {
    expect(seconds({ sec: 3, nanosec: 250_000_000 })).toBe(3.25);
  });

  it("a null anywhere is a gap", () => {
    expect(hasGaps({ pose: { x: 1, y: [0, null] } })).toBe(true);
    expect(hasGaps({ pose: { x: 1, y: [0, 2] }, text: "null" })).toBe(false);
  });

  it("typed arrays hold no gaps", () => {
    expect(hasGaps({ ranges: new Float32Array([NaN]) })).toBe(false);
  });
});

describe("goalText", () => {
  it("joins the state and its reason", () => {
    expect(goalText("stuck", "no way")).toBe("Stuck: no way");
    expect(goalText("reached", "")).toBe("Goal reached");
  });

  it("shows an unknown state unchanged", () => {
    expect(goalText("paused", "")).toBe("paused");
  });
});

describe("runs", () => {
  it("counts equal neighbours", () => {
    expect(runs(Int16Array.from([-1, -1, 3, 3, 3, -1]))).toEqual([-1, 2, 3, 3, -1, 1]);
  });

  it("is empty for no pixels", () => {
    expect(runs(new Int16Array())).toEqual([]);
  });
});
