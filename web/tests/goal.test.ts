import { describe, expect, it } from "vitest";

import { DisplaySet } from "../src/displays/set";
import type { TopicMessage, TopicView } from "../src/protocol";
import { Signal } from "../src/signal";
import { showGoals } from "../src/tools/goal";
import { Topics } from "../src/topics";
import { appOf } from "./fakes";

const PLAN = "/plan";
const GOAL = "/move_base/current_goal";

function status(data: string): TopicMessage {
  return {
    topic: "/navigation_status",
    message: { data },
    time: 1,
    is_latched: false,
  } as unknown as TopicMessage;
}

function lists(...names: string[]): { type: "topics"; topics: TopicView[] } {
  return { type: "topics", topics: names.map((name) => ({ name }) as TopicView) };
}

/** The topics of a page with a simulation, and the topics that its displays show. */
function openPage(): { topics: Topics; displays: DisplaySet; shown: () => unknown[] } {
  const topics = new Topics(() => undefined);
  const displays = new DisplaySet();
  showGoals(appOf({ topics, displays, about: new Signal({ mode: "sim" }) }));
  const shown = (): unknown[] =>
    displays.all.value
      .map(({ properties }) => properties["topic"])
      .filter((topic) => topic === PLAN || topic === GOAL);
  return { topics, displays, shown };
}

describe("showGoals", () => {
  it("shows the goal and the path, also if the topics are listed later", () => {
    const { topics, shown } = openPage();
    topics.receive(status("driving"));
    expect(shown()).toEqual([]);
    topics.setList(lists(PLAN, GOAL));
    expect(shown()).toEqual([GOAL, PLAN]);
  });

  it("shows no path of a policy, which plans none", () => {
    const { topics, shown } = openPage();
    topics.setList(lists(GOAL));
    topics.receive(status("driving"));
    expect(shown()).toEqual([GOAL]);
  });

  it("does not add a display again that the user removed", () => {
    const { topics, displays, shown } = openPage();
    topics.receive(status("driving"));
    topics.setList(lists(PLAN, GOAL));
    displays.remove(displays.all.value.find(({ kind }) => kind === "Path")!.id);
    topics.setList(lists(PLAN, GOAL, "/scan"));
    expect(shown()).toEqual([GOAL]);
  });

  it("shows nothing for a goal that is over before the topics are listed", () => {
    const { topics, shown } = openPage();
    topics.receive(status("driving"));
    topics.receive(status("reached"));
    topics.setList(lists(PLAN, GOAL));
    expect(shown()).toEqual([]);
  });
});
