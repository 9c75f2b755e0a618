import type { App } from "./app";
import { Driver } from "./drive-keys";
import { keepKeysForDriving } from "./focus";
import { useGamepad } from "./gamepad";
import { useKeys } from "./keys";
import { displays } from "./panels/displays";
import { drive } from "./panels/drive";
import { driveHint } from "./panels/drive-hint";
import { findings } from "./panels/findings";
import { help } from "./panels/help";
import { hover } from "./panels/hover";
import { joints } from "./panels/joints";
import { links } from "./panels/links";
import { notices } from "./panels/notices";
import { parameters } from "./panels/parameters";
import { program } from "./panels/program";
import { sheets } from "./panels/sheets";
import { source } from "./panels/source";
import { toolbar } from "./panels/toolbar";
import { topbar } from "./panels/topbar";
import { traffic } from "./panels/traffic";
import { transport } from "./panels/transport";
import { plots } from "./plots/plots";
import { showProgramOutput } from "./program-output";
import { usePush } from "./push";
import { timelineBar } from "./time/timeline";
import { bodyChoice, toolBar } from "./tools/bar";
import { showGoals } from "./tools/goal";
import { ToolBox } from "./tools/toolbox";
import { lookByKeys } from "./view/keyboard";
import type { View } from "./view/view";

/** The areas around the view. */
export interface Places {
  left: HTMLElement;
  centre: HTMLElement;
  right: HTMLElement;
  bottom: HTMLElement;
}

/** Adds all panels and tools to the page. */
export function addPanels(
  app: App,
  view: View,
  picture: HTMLElement,
  { left, centre, right, bottom }: Places,
): void {
  const driver = new Driver(app);
  const keys = help(app);
  const showHelp = (): void => keys.showModal();
  const messages = notices(app, picture);
  messages.prepend(program(app, driver));
  centre.append(
    toolbar(app, () => view),
    messages,
    transport(app),
    timelineBar(app),
    hover(app, view, picture),
  );
  left.append(displays(app), links(app), findings(app));
  right.append(drive(app, driver), joints(app), parameters(app));
  bottom.append(source(app), traffic(app), plots(app));
  document.body.prepend(topbar(app, showHelp));
  document.body.append(sheets(app, left, right), keys);
  app.focused.watch((request) => request && view.viewpoint.focus(request.link));
  const tools = new ToolBox(app, view);
  const body = bodyChoice(app, view, tools);
  centre.append(...toolBar(app, tools, body.element, driveHint(app, driver)));
  usePush(app, view);
  keepKeysForDriving();
  lookByKeys(view.stage, () => view.viewpoint.writeAddress());
  useGamepad(driver);
  useKeys(app, view, driver, showHelp, tools, body);
  showProgramOutput(app);
  showGoals(app);
}
