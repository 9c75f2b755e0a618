import type { App } from "../app";
import { h } from "../dom";
import { icon } from "../icons";

const TOPIC = "/navigation_status";
const WORDS: Record<string, string> = {
  accepted: "Goal accepted",
  driving: "Driving to the goal",
  reached: "Goal reached",
  stuck: "Stuck",
  cancelled: "Goal cancelled",
  refused: "Goal refused",
};
/** The states of a goal in progress. */
export const GOING: readonly string[] = ["accepted", "driving"];
/** Final states that need no action, and the milliseconds for which they are shown. */
const DONE: readonly string[] = ["reached", "cancelled"];
const SHOWN_FOR = 6000;
/** The displays of a goal: their kinds and topics. */
const DISPLAYS: readonly (readonly [kind: string, topic: string])[] = [
  ["Pose", "/move_base/current_goal"],
  ["Path", "/plan"],
];

/** Calls back with each state of a goal, its reason and the simulated time in s. Subscribes once a simulation runs. */
export function onGoal(app: App, onState: (state: string, reason: string, time: number) => void): void {
  let isListening = false;
  let last = "";
  app.about.watch((about) => {
    if (about?.mode !== "sim" || isListening) return;
    isListening = true;
    app.topics.subscribe(TOPIC, ({ message, time, is_latched }) => {
      const words = String(message["data"]);
      const [state = "", ...reason] = words.split(": ");
      const isOld = is_latched && !GOING.includes(state) && ["", words].includes(last); // it ended before this page was opened
      last = words;
      if (!isOld) onState(state, reason.join(": "), time);
    });
  });
}

/** Shows each goal in progress, and the path to it, unless such a display exists. A policy drives without a path. */
export function showGoals(app: App): void {
  let missing: typeof DISPLAYS = [];
  const show = (): void => {
    missing = missing.filter(([kind, topic]) => {
      if (app.displays.all.value.some((display) => display.kind === kind)) return false;
      if (!app.topics.list.value.some(({ name }) => name === topic)) return true; // a status can arrive before the list
      const added = app.displays.add(kind);
      if (added !== null) app.displays.set(added.id, "topic", topic);
      return false;
    });
  };
  onGoal(app, (state) => {
    missing = GOING.includes(state) ? DISPLAYS : [];
    show();
  });
  app.topics.list.watch(show);
}

/** The text of a state and its reason. */
export function goalText(state: string, reason: string): string {
  return [WORDS[state] ?? state, reason].filter(Boolean).join(": ");
}

/** The state of the last goal with its reason, and a button to cancel it. */
export function goalStatus(app: App): HTMLElement {
  const text = h("span", { role: "status" });
  const cancel = h(
    "button",
    {
      type: "button",
      onclick: () =>
        app.send({
          type: "publish",
          topic: "move_base/cancel",
          kind: "actionlib_msgs/GoalID",
          message: { stamp: { sec: 0, nanosec: 0 }, id: "" },
        }),
    },
    "Cancel",
  );
  const close = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Close",
      "aria-label": "Close the goal's state",
      onclick: () => (chip.hidden = true),
    },
    icon("close"),
  );
  const chip = h("div", { class: "goal chip-bar", hidden: true }, icon("goal"), text, cancel, close);
  let timer: ReturnType<typeof setTimeout> | undefined;
  onGoal(app, (state, reason) => {
    clearTimeout(timer);
    if (DONE.includes(state)) timer = setTimeout(() => (chip.hidden = true), SHOWN_FOR);
    text.textContent = goalText(state, reason);
    chip.dataset["state"] = state;
    chip.hidden = false;
    cancel.hidden = !GOING.includes(state);
    close.hidden = !cancel.hidden;
  });
  return chip;
}
