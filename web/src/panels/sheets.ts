import type { App } from "../app";
import { h } from "../dom";
import { icon, type IconName } from "../icons";
import type { Signal } from "../signal";

/** The same media query as in `style/narrow.css`. */
const NARROW = "(width <= 760px) or ((width <= 960px) and (height <= 520px))";

const SHEETS: readonly [string, IconName, string][] = [
  ["drive", "drive", "Drive"],
  ["joints", "joint", "Joints"],
  ["parameters", "sliders", "Parameters"],
  ["displays", "eye", "Displays"],
  ["links", "layers", "Links"],
  ["findings", "warning", "Findings"],
];

/** The buttons that select one of the panels in `docks`. On a narrow page the panels share one place below the view. */
export function sheets(app: App, ...docks: HTMLElement[]): HTMLElement {
  const root = document.documentElement;
  const available = SHEETS.filter(([name]) => docks.some((dock) => dock.querySelector(`#${name}`) !== null));
  const buttons = available.map(([name, image, label]) => {
    const open = (): void => {
      choose(name);
      leave();
    };
    return h("button", { type: "button", "data-sheet": name, onclick: open }, icon(image), label);
  });
  const choose = (name: string): void => {
    root.dataset["sheet"] = name;
    mark();
  };
  /** Marks the selected panel, unless the plots, the traffic or the source cover it. */
  const mark = (): void => {
    const isCovered = app.plots.value || app.traffic.value || app.spot.value !== null;
    for (const button of buttons)
      button.setAttribute(
        "aria-pressed",
        String(!isCovered && button.dataset["sheet"] === root.dataset["sheet"]),
      );
  };
  /** Closes the plots, the traffic and the source, which share the place of the panels. */
  const leave = (except?: Signal<boolean>): void => {
    for (const other of [app.plots, app.traffic]) if (other !== except) other.set(false);
    app.spot.set(null);
  };
  const narrow = matchMedia(NARROW);
  for (const signal of [app.plots, app.traffic])
    signal.watch((open) => open && narrow.matches && leave(signal));
  app.spot.watch(
    (spot) =>
      spot !== null && narrow.matches && [app.plots, app.traffic].forEach((other) => other.set(false)),
  );
  for (const signal of [app.plots, app.traffic, app.spot]) signal.watch(mark);
  app.about.watch((about) => {
    if (about === null || root.dataset["sheet"] !== undefined) return;
    choose(about.mode === "sim" && available.some(([name]) => name === "drive") ? "drive" : "joints");
  });
  return h("nav", { class: "sheets", "aria-label": "Panels" }, ...buttons);
}
