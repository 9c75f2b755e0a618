import "./style";

import { App } from "./app";
import { h } from "./dom";
import { handle } from "./handle";
import { View } from "./view/view";

/** Milliseconds after which the panels are loaded even if nothing has been drawn yet. */
const PATIENCE = 1500;

const app = new App();
app.about.watch((about) => {
  document.documentElement.dataset["mode"] = about?.mode ?? "view";
});
const picture = h("div", { class: "picture" });
const places = {
  left: h("div", { class: "dock left" }),
  centre: h("main", { class: "centre" }, picture),
  right: h("div", { class: "dock right" }),
  bottom: h("div", { class: "bottom" }),
};
document.body.append(...Object.values(places));
const view = new View(app, picture);

// draw the robot first; load and build the panels after the first frame
const drawn = new Promise<void>((resolve) => view.stage.onFirstFrame(resolve));
const late = new Promise<void>((resolve) => setTimeout(resolve, PATIENCE));
void Promise.race([drawn, late]).then(async () => {
  const { addPanels } = await import("./page-layout");
  addPanels(app, view, picture, places);
});
window.kbot = handle(app, view);
