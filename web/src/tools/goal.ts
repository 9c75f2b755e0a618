import type { App } from "../app";
import { h } from "../dom";
import { icon } from "../icons";

const TOPIC = "/navigation_status";
const WORDS: Record<string, string> = { accepted: "Goal accepted", driving: "Driving to the goal", reached: "Goal reached", stuck: "Stuck", cancelled: "Goal cancelled", refused: "Goal refused" };
/** The states in which it is not yet decided. */
export const GOING: readonly string[] = ["accepted", "driving"];

/** Tells of each state of a goal and its reason, from when something is simulated on. */
export function onGoal(app: App, heard: (state: string, reason: string) => void): void {
  let isListening = false;
  app.about.watch((about) => {
    if (about?.mode !== "sim" || isListening) return;
    isListening = true;
    app.topics.listen(TOPIC, ({ message }) => {
      const [state = "", ...reason] = String(message["data"]).split(": ");
      heard(state, reason.join(": "));
    });
  });
}

/** A state and its reason as one says it. */
export function goalWords(state: string, reason: string): string {
  return [WORDS[state] ?? state, reason].filter(Boolean).join(": ");
}

/** How the last goal stands and why, and a button to give it up. */
export function goalStatus(app: App): HTMLElement {
  const text = h("span", { role: "status" });
  const cancel = h("button", { type: "button", onclick: () => app.send({ type: "publish", topic: "move_base/cancel", kind: "actionlib_msgs/GoalID", message: { stamp: { sec: 0, nanosec: 0 }, id: "" } }) }, "Cancel");
  const close = h("button", { type: "button", class: "icon-button", title: "Close", "aria-label": "Close the goal's state", onclick: () => (chip.hidden = true) }, icon("close"));
  const chip = h("div", { class: "goal chip-bar", hidden: true }, icon("goal"), text, cancel, close);
  onGoal(app, (state, reason) => {
    text.textContent = goalWords(state, reason);
    chip.dataset["state"] = state;
    chip.hidden = false;
    cancel.hidden = !GOING.includes(state);
    close.hidden = !cancel.hidden;
  });
  return chip;
}
