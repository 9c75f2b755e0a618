import type { App } from "./app";
import type { Driver } from "./drive-keys";
import { answersToSpace, isField, leaveSlider, takesKeys } from "./focus";
import { chooseTheme } from "./options";
import { stop } from "./panels/drive";
import { press } from "./panels/toolbar";
import type { ToolBox } from "./tools/toolbox";
import type { View } from "./view/view";

/** Keys that undo and redo edits of the file, with Ctrl. */
const CHANGES: Readonly<Record<string, "undo" | "redo">> = { z: "undo", "Shift+z": "redo", y: "redo" };

/** Handles all keys except those that are held to drive. */
export function useKeys(
  app: App,
  view: View,
  driver: Driver,
  help: () => void,
  tools: ToolBox,
  body: { remove: () => void; leave: () => void },
): void {
  const actions: Record<string, () => unknown> = {
    p: () => app.send({ type: "pause", paused: !app.state.value?.paused }),
    " ": () =>
      app.about.value?.mode === "play" && app.send({ type: "pause", paused: !app.state.value?.paused }),
    ".": () => app.send({ type: "advance", seconds: 0.1 }),
    r: () => app.send({ type: "reset" }),
    f: () => (app.selected.value === "" ? view.viewpoint.fit() : view.viewpoint.focus(app.selected.value)),
    l: () => app.about.value?.mode !== "view" && app.plots.set(!app.plots.value),
    y: () => app.about.value?.mode !== "view" && app.traffic.set(!app.traffic.value),
    t: () => chooseTheme(app.theme, app.theme.value === "dark" ? "light" : "dark"),
    "?": help,
    k: () => app.travel.mark(),
    "[": () => app.travel.jump(-1),
    "]": () => app.travel.jump(1),
    Delete: () => body.remove(),
    Backspace: () => body.remove(),
    Escape: () => {
      leaveSlider();
      if (app.travel.isPast) {
        app.travel.goLive();
        return;
      }
      if (tools.back()) return;
      body.leave();
      app.spot.set(null);
      app.selected.set("");
    },
  };
  // Space stops the robot wherever the focus is. Buttons react to Space on keyup, so that is suppressed too; Enter
  // still activates them.
  const space = (event: KeyboardEvent): void => {
    if (event.key !== " " || isField(event.target) || app.about.value?.mode !== "sim") return;
    event.preventDefault();
    event.stopPropagation();
    if (event.type === "keydown" && !event.repeat) stop(app, driver);
  };
  addEventListener("keydown", space, true);
  addEventListener("keyup", space, true);
  addEventListener("keydown", (event) => {
    const command =
      event.ctrlKey || event.metaKey
        ? CHANGES[event.shiftKey ? `Shift+${event.key.toLowerCase()}` : event.key]
        : undefined;
    if (command !== undefined && !isField(event.target) && app.parameters.value?.[command]) {
      event.preventDefault();
      app.send({ type: command });
    }
    const isSave = (event.ctrlKey || event.metaKey) && event.key === "s";
    // the editor has saved its own file
    if (isSave && !event.defaultPrevented && app.drafts.toSave.size > 0) {
      event.preventDefault();
      for (const file of app.drafts.toSave) app.save(file);
    }
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || takesKeys(event)) return;
    if (document.querySelector("dialog[open]") !== null) return;
    if (event.key === " " && answersToSpace(event.target)) return;
    press(app, event.key);
    if (tools.press(event.key.toLowerCase())) {
      event.preventDefault();
      return;
    }
    if (event.key === "Escape" && document.querySelector(":popover-open") !== null) return; // the browser closes the popover
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (action === undefined) return;
    event.preventDefault();
    action();
  });
}
