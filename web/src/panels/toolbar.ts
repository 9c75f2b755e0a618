import type { App } from "../app";
import { h, toggle } from "../dom";
import { icon, type IconName } from "../icons";
import type { Side } from "../view/sides";
import type { View } from "../view/view";
import { saveMenu } from "./save-menu";

/** A toggle button for a view option, a display, or a property of a display. */
interface Chip {
  name: string;
  image: IconName;
  label: string;
  key: string;
  option?: "follow" | "ride" | "flat";
  display?: string;
  property?: string;
}

const CHIPS: readonly Chip[] = [
  { name: "visual", image: "eye", label: "Visual", key: "1", display: "RobotModel", property: "visual" },
  {
    name: "collision",
    image: "box",
    label: "Collision",
    key: "2",
    display: "RobotModel",
    property: "collision",
  },
  {
    name: "inertia",
    image: "weight",
    label: "Inertia",
    key: "3",
    display: "RobotModel",
    property: "inertia",
  },
  { name: "frames", image: "axes", label: "Frames", key: "4", display: "TF", property: "axes" },
  { name: "names", image: "tag", label: "Names", key: "5", display: "TF", property: "names" },
  { name: "grid", image: "grid", label: "Grid", key: "6", display: "Grid" },
  { name: "trail", image: "path", label: "Trail", key: "7", display: "Trail" },
  { name: "scan", image: "scan", label: "Scan", key: "0", display: "LaserScan" },
];
const FLAT: Chip = { name: "flat", image: "box", label: "Ortho", key: "o", option: "flat" };
/** Camera modes for a moving robot. */
const ALONG: readonly Chip[] = [
  { name: "follow", image: "follow", label: "Follow", key: "8", option: "follow" },
  { name: "ride", image: "drive", label: "Ride", key: "9", option: "ride" },
];
const FOR_MOVING = ["trail", "follow", "ride"];

function isOn(app: App, chip: Chip): boolean {
  if (chip.option === "follow") return app.follows;
  return chip.option === undefined
    ? app.displays.isOn(chip.display ?? "", chip.property ?? null)
    : app.options.value[chip.option];
}

function turn(app: App, chip: Chip, on: boolean): void {
  if (chip.option === undefined) app.displays.turn(chip.display ?? "", chip.property ?? null, on);
  else {
    if (chip.option !== "flat") app.overview.set(false);
    app.setOption(chip.option, on);
  }
}

/** Toggles the chip with a key. */
export function press(app: App, key: string): void {
  const chip = [...CHIPS, FLAT, ...ALONG].find((item) => item.key === key);
  if (chip !== undefined) turn(app, chip, !isOn(app, chip));
}

function button(app: App, chip: Chip, title: string, ...content: (Node | string)[]): HTMLButtonElement {
  const made = toggle(chip.label, title, isOn(app, chip), (on) => turn(app, chip, on), ...content);
  made.dataset["option"] = chip.name;
  const show = (): void => made.setAttribute("aria-pressed", String(isOn(app, chip)));
  if (chip.option === undefined) app.displays.all.watch(show);
  else app.options.watch(show);
  if (chip.option === "follow") app.overview.watch(show);
  return made;
}

/** The toolbar: what the view shows, and from where. */
export function toolbar(app: App, view: () => View): HTMLElement {
  const buttons = CHIPS.map((chip) =>
    button(app, chip, `${chip.label} (${chip.key})`, icon(chip.image), h("span", {}, chip.label)),
  );
  const along = ALONG.map((chip) =>
    button(app, chip, chip.name === "ride" ? "View from the robot (9)" : "Follow the robot (8)", chip.label),
  );
  const hide = (): void => {
    for (const item of [...buttons, ...along]) {
      const name = item.dataset["option"] ?? "";
      if (name === "scan") item.hidden = app.topics.firstOfType(["sensor_msgs/msg/LaserScan"]) === "";
      else item.hidden = FOR_MOVING.includes(name) && (app.about.value?.mode ?? "view") === "view";
    }
  };
  app.about.watch(hide);
  app.topics.list.watch(hide);
  const look = (label: string, side: Side): HTMLButtonElement => {
    const made = toggle(label, `Orthographic view from the ${label.toLowerCase()}`, false, () =>
      view().viewpoint.lockTo(side),
    );
    app.options.watch((options) => made.setAttribute("aria-pressed", String(options.side === side)));
    return made;
  };
  const flat = button(app, FLAT, "Orthographic projection (O)", "Ortho");
  return h(
    "div",
    { class: "toolbar" },
    h("div", { class: "chips", role: "toolbar", "aria-label": "Visibility" }, ...buttons),
    h(
      "div",
      { class: "chips looks", role: "toolbar", "aria-label": "View" },
      h(
        "button",
        {
          type: "button",
          title: "Show the whole robot (F)",
          "aria-label": "Show the whole robot",
          onclick: () => view().viewpoint.fit(),
        },
        icon("fit"),
      ),
      look("Front", "front"),
      look("Side", "side"),
      look("Top", "top"),
      flat,
      ...along,
      saveMenu(app, view),
    ),
  );
}
