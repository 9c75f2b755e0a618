import type { App } from "../app";
import { download, h, toggle } from "../dom";
import { icon, type IconName } from "../icons";
import type { Options } from "../options";
import type { View } from "../view/view";

const TOGGLES: readonly [keyof Options, IconName, string, string][] = [
  ["visual", "eye", "Visual", "1"],
  ["collision", "box", "Collision", "2"],
  ["inertia", "weight", "Inertia", "3"],
  ["frames", "axes", "Frames", "4"],
  ["names", "tag", "Names", "5"],
  ["grid", "grid", "Grid", "6"],
  ["trail", "path", "Path", "7"],
  ["follow", "follow", "Follow", "8"],
  ["ride", "drive", "Ride", "9"],
  ["scan", "scan", "Scan", "0"],
];

/** Which display a number key turns on and off. */
export const TOGGLE_KEYS = new Map<string, keyof Options>([...TOGGLES.map(([name, , , key]) => [key, name] as const), ["o", "flat"]]);

async function savePicture(view: View): Promise<void> {
  const blob = await view.png();
  if (blob !== null) download(blob, "kbot.png");
}

/** What is shown, and from where. */
export function toolbar(app: App, view: () => View): HTMLElement {
  const buttons = TOGGLES.map(([name, image, label, key]) => {
    const button = toggle(label, `${label} (${key})`, app.options.value[name], (on) => app.setOption(name, on), icon(image), h("span", {}, label));
    button.dataset["option"] = name;
    app.options.watch((options) => button.setAttribute("aria-pressed", String(options[name])));
    return button;
  });
  app.about.watch((about) => {
    for (const button of buttons) {
      const forDriving = ["trail", "follow", "ride"].includes(button.dataset["option"] ?? "");
      if (button.dataset["option"] === "scan") button.hidden = app.scan.value === null;
      else button.hidden = forDriving && about?.mode !== "sim";
    }
  });
  app.scan.watch((scan) => {
    const button = buttons.find((one) => one.dataset["option"] === "scan");
    if (button !== undefined) button.hidden = scan === null;
  });
  const look = (label: string, azimuth: number, elevation: number): HTMLButtonElement =>
    h("button", { type: "button", title: `Look from ${label.toLowerCase()}`, onclick: () => view().fit(azimuth, elevation) }, label);
  const flat = toggle("Ortho", "Without perspective (O)", app.options.value.flat, (on) => app.setOption("flat", on), "Ortho");
  app.options.watch((options) => flat.setAttribute("aria-pressed", String(options.flat)));
  const save = h("button", { type: "button", title: "Save the picture (PNG)", "aria-label": "Save the picture", onclick: () => void savePicture(view()) }, icon("camera"));
  return h(
    "div",
    { class: "toolbar" },
    h("div", { class: "chips", role: "toolbar", "aria-label": "What is shown" }, ...buttons),
    h(
      "div",
      { class: "chips looks", role: "toolbar", "aria-label": "View" },
      h("button", { type: "button", title: "See the whole robot (F)", "aria-label": "See the whole robot", onclick: () => view().fit() }, icon("fit")),
      look("Front", 0, 6),
      look("Side", 270, 6),
      look("Top", 270, 89.9),
      flat,
      save,
    ),
  );
}
