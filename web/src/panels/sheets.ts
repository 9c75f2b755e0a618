import type { App } from "../app";
import { h } from "../dom";
import { icon, type IconName } from "../icons";

const SHEETS: readonly [string, IconName, string][] = [
  ["drive", "drive", "Drive"],
  ["joints", "joint", "Joints"],
  ["parameters", "sliders", "Parameters"],
  ["displays", "eye", "Displays"],
  ["links", "layers", "Links"],
  ["findings", "warning", "Findings"],
];

/** On a narrow page the panels share one place beneath the picture; this chooses which is seen. */
export function sheets(app: App): HTMLElement {
  const root = document.documentElement;
  const buttons = SHEETS.map(([name, image, label]) =>
    h("button", { type: "button", "data-sheet": name, onclick: () => choose(name) }, icon(image), label),
  );
  const choose = (name: string): void => {
    root.dataset["sheet"] = name;
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset["sheet"] === name));
  };
  app.about.watch((about) => {
    if (about === null || root.dataset["sheet"] !== undefined) return;
    choose(about.mode === "sim" ? "drive" : "joints");
  });
  return h("nav", { class: "sheets", "aria-label": "Panels" }, ...buttons);
}
