import { MathUtils, Vector3 } from "three";

import type { App } from "../app";
import { baseName, h } from "../dom";
import { icon } from "../icons";
import { robotPose } from "../tools/poses";
import { faultForm, faultList } from "./faults";
import { PushFields } from "./push-fields";

/** The menu of the world: its parameters, resets, pushes and faults. */
export function worldMenu(app: App): HTMLElement {
  const menu = h("div", {
    class: "menu",
    id: "world-menu",
    popover: "auto",
    role: "dialog",
    "aria-label": "World and faults",
  });
  const button = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      popovertarget: menu.id,
      title: "World and faults",
      "aria-label": "World and faults",
    },
    icon("sliders"),
  );
  const count = h("span", { class: "acting", "aria-hidden": "true", hidden: true });
  const counted = (active: number): void => {
    count.hidden = active === 0;
    count.textContent = String(active);
    button.setAttribute("aria-label", `World and faults${active === 0 ? "" : `: ${active} active`}`);
  };
  button.append(count);
  menu.append(
    faultList(app, counted),
    parametersOf(app, () => menu.hidePopover()),
    resets(app),
    pushForm(app),
    faultForm(app),
  );
  const holder = h("span", { class: "world-menu" }, button, menu);
  app.about.watch((about) => (holder.hidden = about?.mode !== "sim"));
  return holder;
}

function parametersOf(app: App, done: () => void): HTMLElement {
  const fields = h("div", { class: "fields" });
  const seed = h("input", {
    type: "number",
    min: 0,
    max: 2 ** 53 - 1,
    step: 1,
    value: 0,
    required: true,
    title: "Seed of all random numbers in a run, such as sensor noise",
  });
  const title = h("h2", {});
  let shown = "";
  let filled = "";
  let seedShown = -1;
  app.about.watch((about) => {
    const choice = about?.worlds.find(({ name }) => name === about.world);
    if (about === null) return;
    if (seedShown !== about.seed) seed.value = String((seedShown = about.seed)); // keep what the user is typing
    const values = JSON.stringify(choice?.parameters);
    if (shown === about.world && filled === values) return;
    [shown, filled] = [about.world, values];
    title.textContent = baseName(shown).replaceAll("_", " ");
    fields.replaceChildren(
      ...(choice?.parameters ?? []).map(({ name, value, is_whole }) =>
        h(
          "label",
          {},
          name,
          h("input", { type: "number", name, value, step: is_whole ? 1 : "any", required: true }),
        ),
      ),
    );
  });
  const form = h(
    "form",
    {},
    title,
    fields,
    h("div", { class: "fields" }, h("label", {}, "noise seed", seed)),
    h("button", { class: "primary", type: "submit" }, "Restart"),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const values = [...fields.querySelectorAll("input")]
      .map((input) => `${input.name}=${input.value}`)
      .join(",");
    app.send({
      type: "set_world",
      world: values === "" ? shown : `${shown}:${values}`,
      seed: seed.valueAsNumber,
    });
    done();
  });
  return form;
}

function resets(app: App): HTMLElement {
  const part = (what: "world" | "time", label: string, title: string): HTMLElement =>
    h("button", { type: "button", title, onclick: () => app.send({ type: "reset_part", what }) }, label);
  return h(
    "div",
    { class: "menu-part", role: "group", "aria-label": "Reset the world" },
    h("h2", {}, "Reset the world"),
    h(
      "div",
      { class: "row" },
      part("world", "All but the time", "Reset everything except the time"),
      part("time", "Only the time", "Set the time to 0 and change nothing else"),
    ),
  );
}

/** The form that pushes a link of the robot, in a direction relative to the robot's heading. */
function pushForm(app: App): HTMLElement {
  const link = h("select", { "aria-label": "Link to push" });
  const strength = new PushFields(app, (kick) => (link.hidden = kick));
  const angle = (label: string, title: string): HTMLInputElement =>
    h("input", {
      type: "number",
      min: -360,
      max: 360,
      step: "any",
      value: 0,
      required: true,
      "aria-label": label,
      title,
    });
  const heading = angle("Direction in degrees", "0 is ahead, 90 to the left");
  const up = angle("Upwards in degrees", "0 is level, 90 straight up");
  app.scene.watch((scene) => {
    const before = link.value;
    const names = scene?.links.filter((link) => link.inertia !== null).map((link) => link.name) ?? [];
    link.replaceChildren(...names.map((name) => h("option", { value: name }, name)));
    if (names.includes(before)) link.value = before;
  });
  const degrees = (text: string, field: HTMLInputElement): HTMLElement =>
    h("label", {}, text, h("span", {}, field, h("span", { class: "unit" }, "°")));
  const form = h(
    "form",
    {},
    h("h2", {}, "Push the robot"),
    h("div", { class: "row push" }, strength.element, link),
    h("div", { class: "fields" }, degrees("Direction", heading), degrees("Up", up)),
    h("button", { type: "submit" }, "Apply"),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const rise = MathUtils.degToRad(up.valueAsNumber);
    const yaw = robotPose(app).yaw + MathUtils.degToRad(heading.valueAsNumber);
    strength.give(
      link.value,
      false,
      new Vector3(Math.cos(rise) * Math.cos(yaw), Math.cos(rise) * Math.sin(yaw), Math.sin(rise)),
    );
  });
  return form;
}
