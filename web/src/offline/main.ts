import "../style";

import { App } from "../app";
import { baseName, h } from "../dom";
import { handle } from "../handle";
import { icon } from "../icons";
import { chooseTheme } from "../options";
import { aboutDialog } from "../panels/about";
import { findings } from "../panels/findings";
import { hover } from "../panels/hover";
import { joints } from "../panels/joints";
import { links } from "../panels/links";
import { notices } from "../panels/notices";
import { sheets } from "../panels/sheets";
import { source } from "../panels/source";
import { toolbar } from "../panels/toolbar";
import { storeMeshes } from "../view/meshes";
import { View } from "../view/view";
import { Replies } from "./replies";
import { readSaved } from "./saved";
import { scrub } from "./scrub";

const saved = readSaved();
storeMeshes(saved.meshes);
let replies: Replies;
const app = new App((receive) => (replies = new Replies(receive, saved)));

const theme = h(
  "button",
  {
    class: "icon-button",
    type: "button",
    title: "Dark or light",
    "aria-label": "Dark or light",
    onclick: () => chooseTheme(app.theme, app.theme.value === "dark" ? "light" : "dark"),
  },
  icon("sun"),
);
const aboutKbot = aboutDialog(saved.licences);
const file = h("span", { class: "file" });
app.about.watch((about) => {
  if (about === null) return;
  file.textContent = baseName(about.file);
  document.documentElement.dataset["mode"] = about.mode;
});
const picture = h("div", { class: "picture" });
const centre: HTMLElement = h(
  "main",
  { class: "centre" },
  picture,
  toolbar(app, () => view),
  notices(app, picture),
);
const isChecked = saved.greeting.some((message) => message.type === "findings");
const left = h("div", { class: "dock left" }, links(app), isChecked && findings(app));
const right = h("div", { class: "dock right" }, joints(app));
document.body.append(
  h(
    "header",
    { class: "topbar" },
    h("h1", { class: "brand" }, "KBot"),
    h("span", { class: "crumbs" }, file),
    h("span", { class: "spacer" }),
    theme,
    h(
      "button",
      {
        class: "icon-button",
        type: "button",
        title: "About",
        "aria-label": "About",
        onclick: () => aboutKbot.showModal(),
      },
      icon("info"),
    ),
  ),
  left,
  centre,
  right,
  h("div", { class: "bottom" }, source(app)),
  sheets(app, left, right),
  aboutKbot,
);
const view = new View(app, picture);
app.focused.watch((request) => request && view.viewpoint.focus(request.link));
centre.append(hover(app, view, picture));
if (saved.states.length > 1)
  queueMicrotask(() => centre.append(scrub(saved.states, (index) => replies.show(index))));
window.kbot = handle(app, view);
