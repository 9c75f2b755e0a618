import type { App } from "../app";
import type { Driver } from "../drive-keys";
import { h, write } from "../dom";
import { icon } from "../icons";
import type { ProgramView } from "../protocol";
import { stop } from "./drive";
import { closeButton } from "./notices";

/** The user's program: whether it drives the robot, its error, and a button to stop it or to start it again. */
export function program(app: App, driver: Driver): HTMLElement {
  const status = h("span", { role: "status" });
  const error = h("pre", { tabindex: 0, role: "group", "aria-label": "Error of the program" });
  const end = h(
    "button",
    { type: "button", title: "Stop the program (Space)", onclick: () => stop(app, driver) },
    "Stop",
  );
  const start = h("button", { type: "button", onclick: () => app.send({ type: "run_program" }) }, "Run");
  const sign = h("span", { class: "sign", "aria-hidden": "true" });
  const printed = h("button", {
    type: "button",
    class: "printed",
    title: "The last printed line. Click to open the log (Y).",
    hidden: true,
    onclick: () => app.traffic.set(true),
  });
  /** The error that the user has closed. Another one is shown again. */
  let closed = "";
  const close = closeButton("Close the error of the program", () => {
    closed = error.textContent;
    error.hidden = close.hidden = true;
    start.focus();
  });
  const bar = h(
    "div",
    { class: "notice program", hidden: true },
    sign,
    status,
    end,
    start,
    printed,
    close,
    error,
  );
  let wasStill = false;
  app.program.watch((now) => {
    bar.hidden = now === null;
    if (now === null) return;
    const hadFocus = bar.contains(document.activeElement);
    bar.dataset["phase"] = now.phase;
    bar.classList.toggle("error", now.phase === "failed");
    sign.replaceChildren(icon(signOf(now)));
    // while time stands still, the seconds in the text change: a screen reader reads it once
    const isStill = now.phase === "running" && now.note !== "";
    status.ariaLive = isStill && wasStill ? "off" : "polite";
    wasStill = isStill;
    status.textContent = statusText(now);
    error.textContent = now.error;
    if (now.error === "") closed = "";
    error.hidden = close.hidden = now.error === closed;
    end.hidden = now.phase !== "running";
    start.hidden = !now.can_start || now.phase === "running" || now.phase === "waiting";
    start.title = `Start ${now.name} again, from the start`;
    // the button that was pressed is hidden: the keyboard continues on the other one
    if (hadFocus && document.activeElement === document.body) (end.hidden ? start : end).focus();
  });
  const showPrinted = (): void => {
    const text = app.program.value?.error === "" ? app.printed.value : ""; // the error is printed too
    write(printed, text);
    printed.hidden = text === "";
  };
  app.printed.watch(showPrinted);
  app.program.watch(showPrinted);
  return bar;
}

function signOf({ phase }: ProgramView): "play" | "error" | "check" | "pause" {
  if (phase === "running") return "play";
  if (phase === "failed") return "error";
  return phase === "finished" ? "check" : "pause";
}

/** One sentence about who drives. */
export function statusText({ name, phase, note, can_start }: ProgramView): string {
  if (note !== "") return `${note}.`;
  switch (phase) {
    case "waiting":
      return `${name} starts soon.`;
    case "running":
      return `${name} drives the robot.`;
    case "finished":
      return can_start
        ? `${name} finished. The simulation is paused.`
        : `${name} is in page.wait(). You can drive.`;
    case "failed":
      return `${name} failed:`;
    case "stopped":
      return `${name} was stopped. The simulation is paused.`;
  }
}
