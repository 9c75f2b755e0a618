import "./style";

import { App } from "./app";
import { h } from "./dom";
import { handle } from "./handle";
import { View } from "./view/view";

/** The panels come no later than this, in milliseconds, even where nothing can be drawn. */
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

// the picture first: what stands around it is fetched and made when it is there
const drawn = new Promise<void>((resolve) => view.stage.onFirstFrame(resolve));
const late = new Promise<void>((resolve) => setTimeout(resolve, PATIENCE));
void Promise.race([drawn, late]).then(async () => {
  const { furnish } = await import("./furnish");
  furnish(app, view, picture, places);
});
window.kbot = handle(app, view);
