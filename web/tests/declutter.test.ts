import { describe, expect, it } from "vitest";

import { stepsUp } from "../src/displays/declutter";

const label = { left: 10, top: 100, width: 50, height: 20 };

describe("stepsUp", () => {
  it("leaves a label where it covers nothing", () => {
    expect(stepsUp(label, [])).toBe(0);
    expect(stepsUp(label, [{ left: 60, top: 100, width: 50, height: 20 }])).toBe(0); // they only touch
  });

  it("moves a label above those that it would cover", () => {
    expect(stepsUp(label, [label])).toBe(1);
    expect(stepsUp(label, [label, { ...label, top: 80 }])).toBe(2);
    expect(stepsUp(label, [{ ...label, top: 90 }])).toBe(2); // this one covers half of both places
    expect(stepsUp(label, [label, { ...label, top: 60 }])).toBe(1); // between the two
  });

  it("leaves a label where it is if there is no free place near it", () => {
    expect(stepsUp(label, [{ left: 0, top: -5000, width: 500, height: 10_000 }])).toBe(0);
  });
});
