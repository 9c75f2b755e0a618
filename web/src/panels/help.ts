import type { App } from "../app";
import { h } from "../dom";
import { about } from "./about";

/** Keys, their actions, and the mode they need: a simulation, a recording, or either (`time`). */
const KEYS: readonly [string, string, ("sim" | "play" | "time")?][] = [
  ["W A S D, arrows", "hold to drive", "sim"],
  ["arrows", "move the slider that was used last"],
  ["Space", "stop the robot", "sim"],
  ["Shift + drag", "push a link of the robot", "sim"],
  ["I", "interact: rotate the view, select"],
  ["G, E, U", "2D goal, pose estimate, publish point", "sim"],
  ["M, C", "measure, focus on a point"],
  ["V, N, B", "move, push, add an object", "sim"],
  ["arrows, Enter", "in the view: move the tool, use it"],
  ["Delete", "delete the selected object", "sim"],
  ["P", "pause, continue", "sim"],
  ["P, Space", "pause, continue", "play"],
  [".", "step by 0.1 s", "sim"],
  ["R", "reset", "sim"],
  ["Shift + arrows, Ctrl + arrows", "rotate the view, pan"],
  ["+, -", "zoom in, zoom out"],
  ["F", "show the whole robot or the selected link"],
  ["1 – 7, 0", "show or hide shapes, collisions, inertias, frames, names, grid, trail, lidar scan"],
  ["8", "follow the robot with the camera, or keep the camera still", "time"],
  ["9", "ride on the robot, or leave it", "time"],
  ["O", "toggle orthographic projection"],
  ["K", "bookmark the time shown", "time"],
  ["[, ]", "go to the previous or next bookmark", "time"],
  ["L", "plots", "time"],
  ["arrows, +, -, 0", "on a plot's time line: move through time, zoom in, zoom out, show all", "time"],
  ["Y", "topics and log", "time"],
  ["T", "toggle dark and light theme"],
  ["Ctrl+Z, Ctrl+Shift+Z", "undo, redo an edit of the file"],
  ["Escape", "leave the tool; close the source and clear the selection"],
];

/** The dialog that lists all keys. */
export function help(app: App): HTMLDialogElement {
  const list = h("dl");
  app.about.watch((about) => {
    const shown = KEYS.filter(
      ([, , need]) =>
        need === undefined || need === about?.mode || (need === "time" && about?.mode !== "view"),
    );
    list.replaceChildren(
      ...shown.flatMap(([key, what]) => [
        h("dt", {}, ...key.split(", ").flatMap((k, i) => [i > 0 && " ", h("kbd", {}, k)])),
        h("dd", {}, what),
      ]),
    );
  });
  const dialog = h(
    "dialog",
    { class: "help", "aria-label": "Keys" },
    h("h2", { tabindex: -1, autofocus: true }, "Keys"), // a dialog scrolls to its focused element, so the heading gets the focus
    list,
    h(
      "p",
      {},
      "Click a link in the view or in the list to show its line in the source. Double-click it to zoom to it. Click a finding to show its line and its link. In the source, drag or double-click a number to edit the file.",
    ),
    about(),
    h("form", { method: "dialog" }, h("button", { class: "primary" }, "Close")),
  );
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  return dialog;
}
