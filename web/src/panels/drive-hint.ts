import type { App } from "../app";
import { h } from "../dom";
import type { Driver } from "../drive-keys";
import { icon } from "../icons";

const KEY = "kbot.driven";

/** The hint how to drive, over the view. It disappears for this browser tab once the user drives. */
export function driveHint(app: App, driver: Driver): HTMLElement {
  const key = (name: string): HTMLElement => h("kbd", {}, name);
  const hint = h(
    "div",
    { class: "drive-hint chip-bar", hidden: true },
    icon("drive"),
    h(
      "span",
      { class: "by-keys" },
      "Hold ",
      key("W"),
      " ",
      key("A"),
      " ",
      key("S"),
      " ",
      key("D"),
      " to drive",
    ),
    h("span", { class: "by-touch" }, "Drag the pad below to drive"),
  );
  let hasDriven = isStored();
  const show = (): void => {
    const about = app.about.value;
    const program = app.program.value;
    const isFree = program === null || (program.phase === "finished" && !program.can_start);
    const mayDrive = isFree && app.state.value?.paused !== true && app.connection.link.value !== "lost";
    hint.hidden = hasDriven || about?.mode !== "sim" || about.cannot_drive !== "" || !mayDrive;
  };
  app.about.watch(show);
  app.program.watch(show);
  app.state.watch(show);
  app.connection.link.watch(show);
  driver.stick.watch(([forward, left]) => {
    if (hasDriven || (forward === 0 && left === 0)) return;
    hasDriven = true;
    remember();
    show();
  });
  return hint;
}

function isStored(): boolean {
  try {
    return sessionStorage.getItem(KEY) !== null;
  } catch {
    return false; // storage is disabled
  }
}

function remember(): void {
  try {
    sessionStorage.setItem(KEY, "yes");
  } catch {
    // storage is disabled: the hint returns when the page is loaded again
  }
}
