import type { App } from "../app";
import { h } from "../dom";

/** Keys, what they do, and whether something must be simulated for it. */
const KEYS: readonly [string, string, ("sim" | "play" | "time")?][] = [
  ["W A S D, arrows", "drive, while held", "sim"],
  ["arrows", "on the slider that was used last: move it"],
  ["Space", "stop", "sim"],
  ["Shift + drag", "push a link of the robot", "sim"],
  ["I", "turn the view and select"],
  ["G, E, U", "2D goal, pose estimate, publish point", "sim"],
  ["M, C", "measure, look at a place"],
  ["V, N, B", "move the robot or a thing, push it, add a thing", "sim"],
  ["arrows, Enter", "in the picture: move the tool, use it"],
  ["Delete", "take the chosen thing away", "sim"],
  ["P", "pause, go on", "sim"],
  ["P, Space", "pause, go on", "play"],
  [".", "step, when paused", "sim"],
  ["R", "reset", "sim"],
  ["Shift + arrows, Ctrl + arrows", "turn the view, move it"],
  ["+, -", "come closer, go back"],
  ["F", "see the whole robot, or the chosen link"],
  ["0 – 9", "displays on and off"],
  ["O", "with or without perspective"],
  ["K", "bookmark the moment on show", "time"],
  ["[, ]", "go to the bookmark before or after", "time"],
  ["L", "plots", "time"],
  ["arrows, +, -, 0", "in a plot, on its line: go through time, look closer, at all", "time"],
  ["Y", "topics and log", "time"],
  ["T", "dark or light"],
  ["Ctrl+Z, Ctrl+Shift+Z", "undo, redo a change made to the file here"],
  ["Escape", "leave the tool; close the source, choose nothing"],
];

/** The keys, in a dialog. */
export function help(app: App): HTMLDialogElement {
  const list = h("dl");
  app.about.watch((about) => {
    const known = KEYS.filter(
      ([, , need]) =>
        need === undefined || need === about?.mode || (need === "time" && about?.mode !== "view"),
    );
    list.replaceChildren(
      ...known.flatMap(([key, what]) => [
        h("dt", {}, ...key.split(", ").flatMap((k, i) => [i > 0 && " ", h("kbd", {}, k)])),
        h("dd", {}, what),
      ]),
    );
  });
  const dialog = h(
    "dialog",
    { class: "help", "aria-label": "Keys" },
    h("h2", { tabindex: -1, autofocus: true }, "Keys"), // a dialog scrolls to what has its focus
    list,
    h(
      "p",
      {},
      "Click a link, in the picture or in the list, to see the line it is written on; double-click it to fill the picture with it. Click a finding to see its line and its link. In the source, drag a number or double-click it to change it in the file.",
    ),
    h("form", { method: "dialog" }, h("button", { class: "primary" }, "Close")),
  );
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  return dialog;
}
