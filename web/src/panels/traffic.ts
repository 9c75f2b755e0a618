import type { App } from "../app";
import { h } from "../dom";
import { icon } from "../icons";
import { log } from "./log";
import { topicTree } from "./topics";

/** The topics and the log, below the view. */
export function traffic(app: App): HTMLElement {
  const close = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Close topics and log (Y)",
      "aria-label": "Close topics and log",
      onclick: () => app.traffic.set(false),
    },
    icon("close"),
  );
  const dock = h(
    "section",
    { id: "traffic", class: "panel", "aria-label": "Topics and log", hidden: true },
    h("header", { class: "panel-head" }, h("h2", {}, "Topics and log"), close),
    h("div", { class: "traffic" }, topicTree(app), log(app)),
  );
  app.traffic.watch((open) => (dock.hidden = !open));
  return dock;
}
