import "./style";

import { App } from "./app";
import { Driver } from "./drive-keys";
import { h } from "./dom";
import { keepKeysForDriving } from "./focus";
import { useGamepad } from "./gamepad";
import { handle } from "./handle";
import { History } from "./history";
import { useKeys } from "./keys";
import { displays } from "./panels/displays";
import { drive } from "./panels/drive";
import { findings } from "./panels/findings";
import { help } from "./panels/help";
import { hover } from "./panels/hover";
import { joints } from "./panels/joints";
import { links } from "./panels/links";
import { parameters } from "./panels/parameters";
import { notices } from "./panels/notices";
import { plots } from "./panels/plots";
import { source } from "./panels/source";
import { sheets } from "./panels/sheets";
import { toolbar } from "./panels/toolbar";
import { topbar } from "./panels/topbar";
import { transport } from "./panels/transport";
import { usePush } from "./push";
import { timelineBar } from "./time/timeline";
import { bodyChoice, toolBar } from "./tools/bar";
import { ToolBox } from "./tools/toolbox";
import { View } from "./view/view";

const app = new App();
const driver = new Driver(app);
const keys = help(app);
const showHelp = (): void => keys.showModal();

const picture = h("div", { class: "picture" });
let view: View;
const centre = h("main", { class: "centre" }, picture, toolbar(app, () => view), notices(app, picture), transport(app), timelineBar(app));
const left = h("div", { class: "dock left" }, displays(app), links(app), findings(app));
const right = h("div", { class: "dock right" }, drive(app, driver), joints(app), parameters(app));
document.body.append(topbar(app, showHelp), left, centre, right, h("div", { class: "bottom" }, source(app), plots(app, new History(app))), sheets(app), keys);
app.about.watch((about) => {
  document.documentElement.dataset["mode"] = about?.mode ?? "view";
});

view = new View(app, picture);
app.focused.watch((asked) => asked && view.focus(asked.link));
centre.append(hover(app, view, picture));
const tools = new ToolBox(app, view);
const body = bodyChoice(app, view, tools);
centre.append(...toolBar(app, tools, body.element));
usePush(app, view);
keepKeysForDriving();
useGamepad(driver);
useKeys(app, view, driver, showHelp, tools, body);
window.kbot = handle(app, view);
