import { beforeEach, describe, expect, it, vi } from "vitest";

import { paddedRange, tickLabel } from "../src/plots/axis";
import { fields, labelled, storedFields } from "../src/plots/fields";
import { MOST_CURVES, strokeOf } from "../src/plots/graph";
import { Span } from "../src/plots/span";
import { Table } from "../src/plots/table";
import { fieldName, numberAt, TopicField } from "../src/plots/topic-field";
import type { FromPage, Series, Timeline } from "../src/protocol";
import { Signal } from "../src/signal";
import { Topics } from "../src/topics";
import { appOf, joint, scene, state, timeline } from "./fakes";

describe("paddedRange", () => {
  it("adds 6 percent on each side", () => {
    const [low, high] = paddedRange(0, 10);
    expect(low).toBeCloseTo(-0.6, 12);
    expect(high).toBeCloseTo(10.6, 12);
  });

  it("gives a constant value a margin", () => {
    expect(paddedRange(5, 5)).toEqual([4.5, 5.5]);
    expect(paddedRange(0, 0)).toEqual([-0.5, 0.5]);
  });

  it("does not enlarge rounding errors to the height of the plot", () => {
    const [low, high] = paddedRange(0, 1e-12);
    expect(high - low).toBeCloseTo(1e-6, 12);
  });

  it("is 0 to 1 without values", () => {
    expect(paddedRange(null, null)).toEqual([0, 1]);
  });
});

describe("tickLabel", () => {
  it.each([
    [0.1 + 0.2, "0.3"],
    [0, "0"],
    [-2.5, "-2.5"],
    [0.00002, "2e-5"],
    [1500, "1500"],
  ])("of %f is %s", (tick, text) => {
    expect(tickLabel(tick)).toBe(text);
  });
});

describe("strokes", () => {
  it("differ for as many curves as can be plotted", () => {
    const strokes = Array.from({ length: MOST_CURVES }, (_, index) => JSON.stringify(strokeOf(index)));
    expect(new Set(strokes).size).toBe(MOST_CURVES);
  });

  it("are solid first, then dashed", () => {
    expect(strokeOf(0).dash).toEqual([]);
    expect(strokeOf(6)).toEqual({ colour: strokeOf(0).colour, dash: [8, 4] });
  });
});

describe("fields", () => {
  const view = scene({ joints: [joint({ name: "lift", kind: "prismatic" }), joint({ name: "elbow" })] });

  it("have the unit of their joint", () => {
    const found = fields(view, false).filter(({ group }) => group === "Joints");
    expect(found.map(labelled)).toEqual(["lift [m]", "elbow [rad]"]);
  });

  it("read their number from a state", () => {
    const found = fields(view, false).find(({ name }) => name === "elbow")!;
    expect(found.value(state({ positions: [0.1, 0.7] }))).toBe(0.7);
    expect(found.key).toBe("state positions.elbow");
  });

  it("of a recording leave out what it does not hold", () => {
    const names = fields(view, true).map(({ name }) => name);
    expect(names).not.toContain("real-time factor");
    expect(names).toContain("x");
  });

  it("without a unit have no brackets", () => {
    expect(labelled(fields(null, false).find(({ key }) => key === "state rate")!)).toBe("real-time factor");
  });
});

describe("storedFields", () => {
  it.each([
    ['["x", "y", 3]', ["x", "y"]],
    ["no JSON", ["forward speed", "commanded forward speed", "turning speed"]],
    ['{"x": 1}', ["forward speed", "commanded forward speed", "turning speed"]],
  ])("of %s are %j", (kept, expected) => {
    vi.stubGlobal("localStorage", { getItem: () => kept });
    expect(storedFields()).toEqual(expected);
    vi.unstubAllGlobals();
  });
});

describe("Table", () => {
  const speed = fields(null, false)[0]!;
  let sent: FromPage[] = [];
  let table: Table;

  beforeEach(() => {
    sent = [];
    table = new Table(appOf({ send: (message: FromPage) => sent.push(message) }));
    table.choose([speed]);
  });

  function answer(at: number[], end: number): Series {
    return {
      type: "series",
      number: 1,
      start: 0,
      end,
      is_thinned: false,
      at,
      time: at,
      values: [at.map((moment) => moment * 10)],
    };
  }

  it("requests a second more on either side", () => {
    table.need(5, 8);
    expect(sent).toEqual([{ type: "ask_series", number: 1, fields: ["state twist.0"], start: 4, end: 9 }]);
  });

  it("requests once while an answer is pending", () => {
    table.need(5, 8);
    table.need(5, 8.1);
    expect(sent).toHaveLength(1);
  });

  it("does not request the rows that it has", () => {
    table.need(1, 3);
    table.receive(answer([0, 1, 2, 3], 4));
    table.need(1, 3);
    expect(sent).toHaveLength(1);
  });

  it("ignores an answer to an older question", () => {
    table.need(1, 3);
    table.forget();
    table.need(1, 3);
    expect(table.receive(answer([0, 1], 4))).toBe(false);
    expect(table.at).toEqual([]);
  });

  it("appends states that follow without a gap", () => {
    table.need(0, 2);
    table.receive(answer([0, 1, 2], 3));
    table.add(state({ at: 2.1, time: 2.1, twist: [0.4, 0] }));
    table.add(state({ at: 2.1, twist: [9, 0] })); // the same moment again
    table.add(state({ at: 3.5, twist: [9, 0] })); // more than half a second on
    expect(table.at).toEqual([0, 1, 2, 2.1]);
    expect(table.columns).toEqual([[0, 10, 20, 0.4]]);
  });

  it.each([
    [-0.5, -1],
    [0, 0],
    [1.9, 1],
    [2, 2],
    [99, 2],
  ])("finds the last row at %f s: %d", (at, index) => {
    table.need(0, 2);
    table.receive(answer([0, 1, 2], 3));
    expect(table.indexAt(at)).toBe(index);
  });

  it("finds where the clock was set back", () => {
    table.need(0, 3);
    table.receive({ ...answer([0, 1, 2, 3], 4), time: [0, 1, 0, 1] });
    expect(table.jumps(0, 4)).toEqual([2]);
    expect(table.jumps(3, 4)).toEqual([]);
  });

  it("writes the rows on show as CSV, with the unit in the head", async () => {
    table.need(0, 2);
    table.receive(answer([0, 1, 2], 3));
    expect(await table.csv(1, 2).text()).toBe('"time [s]","forward speed [m/s]"\n1,10\n2,20\n');
  });
});

describe("Span", () => {
  function spanOf(now: Timeline): Span {
    const travel = {
      timeline: new Signal(now),
      isPast: !now.live,
      get at() {
        return now.at;
      },
    };
    return new Span(appOf({ travel, state: new Signal(state({ at: now.end })) }));
  }

  it("follows the last 20 s of a simulation", () => {
    expect(spanOf(timeline({ end: 100, at: 100 })).range()).toEqual([80, 100]);
  });

  it("starts with the run if that is shorter", () => {
    expect(spanOf(timeline({ end: 5, at: 5 })).range()).toEqual([0, 5]);
  });

  it("centres a time in the past", () => {
    expect(spanOf(timeline({ end: 100, at: 50, live: false })).range()).toEqual([40, 60]);
  });

  it("shows all", () => {
    const span = spanOf(timeline({ start: 10, end: 100, at: 100 }));
    span.choose("all");
    expect(span.range()).toEqual([10, 100]);
  });

  it("zooms about a time, which keeps its place in the plot", () => {
    const span = spanOf(timeline({ end: 100, at: 100 }));
    span.zoomBy(0.5, 95); // three quarters of the way from 80 to 100
    expect(span.range()).toEqual([87.5, 97.5]);
  });

  it("zooms to a tenth of a second at most", () => {
    const span = spanOf(timeline({ end: 100, at: 100 }));
    span.zoomBy(1e-9, 90);
    const [low, high] = span.range();
    expect(high - low).toBeCloseTo(0.1, 9);
  });
});

describe("TopicField", () => {
  it("has the value of the last message before a state", () => {
    const topics = new Topics(() => undefined);
    const field = new TopicField(topics, "/imu", ["angular_velocity", "z"]);
    field.setActive(true);
    for (const [time, z] of [
      [1, 0.1],
      [2, 0.2],
    ] as const)
      topics.receive({
        type: "message",
        topic: "/imu",
        kind: "",
        time,
        is_latched: false,
        message: { angular_velocity: { z } },
      });
    expect(field.value(state({ time: 0.5 }))).toBeNaN();
    expect(field.value(state({ time: 1.5 }))).toBe(0.1);
    expect(field.value(state({ time: 3 }))).toBe(0.2);
  });

  it("is named after its topic and path", () => {
    expect(fieldName("/imu", ["angular_velocity", "z"])).toBe("/imu angular_velocity.z");
  });

  it.each([
    [{ a: { b: 3 } }, 3],
    [{ a: { b: true } }, 1],
    [{ a: { b: "3" } }, null],
    [{ a: null }, null],
    [{}, null],
  ])("reads %j as %j", (message, expected) => {
    expect(numberAt(message, ["a", "b"])).toBe(expected);
  });
});
