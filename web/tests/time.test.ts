import { beforeEach, describe, expect, it, vi } from "vitest";

import type { FromPage } from "../src/protocol";
import { Signal } from "../src/signal";
import { Bookmarks } from "../src/time/bookmarks";
import { TimeTravel } from "../src/time/travel";
import { Topics } from "../src/topics";
import { looksTheSame } from "../src/view/still";
import { state, timeline } from "./fakes";

describe("Bookmarks", () => {
  const bookmarks = new Bookmarks();
  bookmarks.all.set([2, 5, 9].map((at, number) => ({ number, at, time: at, note: "" })));

  it.each([
    [5, 1, 9],
    [5, -1, 2],
    [0, 1, 2],
    [9, 1, undefined],
  ] as const)("from %d s in direction %d it goes to %s s", (at, direction, expected) => {
    expect(bookmarks.next(at, direction, 0)?.at).toBe(expected);
  });

  it("skips those that are no longer kept", () => {
    expect(bookmarks.next(5, -1, 4)).toBeUndefined();
  });
});

describe("TimeTravel", () => {
  let frames: (() => void)[] = [];
  let sent: FromPage[] = [];
  let travel: TimeTravel;
  let now: Signal<ReturnType<typeof state> | null>;

  beforeEach(() => {
    frames = [];
    sent = [];
    vi.stubGlobal("requestAnimationFrame", (action: () => void) => frames.push(action));
    now = new Signal<ReturnType<typeof state> | null>(state({ at: 10, time: 10 }));
    travel = new TimeTravel(now, new Topics(() => undefined), (message) => sent.push(message));
  });

  it("sends only the last of several times requested in one frame", () => {
    travel.receive(timeline());
    travel.seek(3);
    travel.seek(4);
    for (const frame of frames) frame();
    expect(sent).toEqual([{ type: "seek", at: 4 }]);
  });

  it("waits until the server shows the requested time", () => {
    travel.receive(timeline());
    travel.seek(4);
    expect(travel.awaited).toBe(4);
    travel.receive(timeline({ live: false, at: 3, asked: 3 }));
    expect(travel.awaited).toBe(4);
    travel.receive(timeline({ live: false, at: 4, asked: 4 }));
    expect(travel.awaited).toBeNull();
    expect(travel.seeks).toBe(true);
    travel.stateArrived();
    expect(travel.seeks).toBe(false);
  });

  it("steps back by a tenth of a second", () => {
    travel.receive(timeline({ live: false, at: 5 }));
    travel.step(-1);
    expect(travel.awaited).toBe(4.9);
  });

  it("steps back to the start at most", () => {
    travel.receive(timeline({ live: false, start: 2, at: 2.05 }));
    travel.step(-1);
    expect(travel.awaited).toBe(2);
  });

  it("returns to live when it steps past the end", () => {
    travel.receive(timeline({ live: false, at: 9.95 }));
    travel.step(1);
    expect(sent).toEqual([{ type: "go_live" }]);
  });

  it("stays at the end of a recording", () => {
    travel.receive(timeline({ live: false, played: true, at: 9.95 }));
    travel.step(1);
    expect(travel.awaited).toBe(10);
  });

  it("returns to live before the robot is driven", () => {
    travel.receive(timeline({ live: false, at: 5 }));
    travel.beforeSend({ type: "drive", linear: 1, angular: 0 });
    expect(sent).toEqual([{ type: "go_live" }]);
  });

  it("stays in the past for messages that do not act on the simulation", () => {
    travel.receive(timeline({ live: false, at: 5 }));
    travel.beforeSend({ type: "subscribe", topic: "/scan" });
    expect(sent).toEqual([]);
  });

  it("shows whether the simulation is paused now, not at the time shown", () => {
    travel.receive(timeline({ live: false, paused: true, speed: 2 }));
    expect(travel.withCurrentSpeed(state())).toMatchObject({ paused: true, speed: 2 });
  });

  it("jumps to the bookmark before the time shown", () => {
    travel.receive(timeline({ live: false, at: 5 }));
    now.set(state({ at: 5 }));
    travel.bookmarks.all.set([{ number: 1, at: 2, time: 2, note: "" }]);
    travel.jump(-1);
    expect(travel.awaited).toBe(2);
  });
});

describe("looksTheSame", () => {
  const before = state({ time: 1, poses: [0, 0, 0, 0, 0, 0, 1] });

  it("does not depend on the time", () => {
    expect(looksTheSame(before, { ...before, time: 9 })).toBe(true);
  });

  it.each([
    ["a link moved", { poses: [0.1, 0, 0, 0, 0, 0, 1] }],
    ["a body moved", { bodies: [1] }],
    ["the simulation was reset", { resets: 1 }],
    ["a frame was added", { frames: [["map", ""]] }],
  ])("is false after %s", (_, change) => {
    expect(looksTheSame(before, { ...before, ...change })).toBe(false);
  });
});
