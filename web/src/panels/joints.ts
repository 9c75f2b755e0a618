import { wrap } from "../angles";
import type { App } from "../app";
import { h, panel, readout, rounded, toggle } from "../dom";
import { sliderHold } from "../slider-hold";
import type { JointView, State } from "../protocol";

/** Number of joints from which a search field is shown. */
const MANY = 8;
/** Changes below this fraction of the range do not move a slider: a joint at rest always jitters slightly. */
const UNSEEN = 1e-5;

interface Row {
  joint: JointView;
  /** Index of its position in a state. */
  index: number;
  element: HTMLElement;
  slider: HTMLInputElement;
  show: (position: number) => void;
  isHeld: () => boolean;
}

/** The Joints panel: a slider and a number for each joint. In a simulation they show the joint's position and, if it has a
 * controller, command its position or speed. */
export function joints(app: App): HTMLElement {
  const list = h("div", { class: "joints" });
  const preset = (kind: "zero" | "centre" | "random", label: string): HTMLButtonElement =>
    h(
      "button",
      {
        type: "button",
        title: `All joints: ${label.toLowerCase()}`,
        onclick: () => app.send({ type: "set_joints", preset: kind }),
      },
      label,
    );
  const presets = h(
    "div",
    { class: "buttons" },
    preset("zero", "Zero"),
    preset("centre", "Centre"),
    preset("random", "Random"),
  );
  const unit = (label: string, title: string, sign: string, radians: boolean): HTMLButtonElement =>
    toggle(
      label,
      title,
      app.options.value.radians === radians,
      () => app.setOption("radians", radians),
      sign,
    );
  const degrees = unit("degrees and mm", "Degrees and millimetres", "°", false);
  const radians = unit("rad and m", "Radians and metres", "rad", true);
  const units = h("div", { class: "units", role: "group", "aria-label": "Units" }, degrees, radians);
  const search = h("input", {
    type: "search",
    placeholder: "Search joints",
    "aria-label": "Search joints",
    oninput: () => filter(),
  });
  const nothing = h("p", { class: "nothing" });
  let rows: Row[] = [];
  const filter = (): void => {
    const query = search.value.toLowerCase();
    for (const { joint, element } of rows) element.hidden = !joint.name.toLowerCase().includes(query);
    const hasMatch = rows.some(({ element }) => !element.hidden);
    nothing.hidden = hasMatch;
    nothing.textContent = rows.length === 0 ? "This robot has no movable joints." : "No joint matches.";
  };
  const build = (): void => {
    const joints = app.scene.value?.joints ?? [];
    presets.hidden = app.about.value?.mode !== "view" || joints.length === 0;
    units.hidden = joints.length === 0;
    search.hidden = joints.length < MANY;
    if (search.hidden) search.value = "";
    rows = joints.map((joint, index) => row(app, joint, index));
    const focused = list.contains(document.activeElement)
      ? document.activeElement?.getAttribute("aria-label")
      : null;
    list.replaceChildren(search, nothing, ...rows.map(({ element }) => element));
    filter();
    // without this, the arrow keys would suddenly drive the robot
    if (focused != null) list.querySelector<HTMLElement>(`[aria-label="${CSS.escape(focused)}"]`)?.focus();
    if (app.state.value !== null) update(rows, app.state.value);
  };
  let shown: readonly JointView[] | undefined;
  app.scene.watch((scene) => {
    if (scene?.joints === shown) return;
    shown = scene?.joints;
    build();
  });
  let inRadians = app.options.value.radians;
  app.options.watch((options) => {
    degrees.setAttribute("aria-pressed", String(!options.radians));
    radians.setAttribute("aria-pressed", String(options.radians));
    if (options.radians === inRadians) return;
    inRadians = options.radians;
    build();
  });
  app.state.watchThrottled((state) => state && update(rows, state));
  return panel("joints", "Joints", [presets, units], list);
}

function row(app: App, joint: JointView, index: number): Row {
  const [factor, digits, unit, unitName] = unitOf(joint, app.options.value.radians);
  const fixed = joint.control === "none";
  const send = (position: number): void => {
    if (Number.isFinite(position)) app.send({ type: "set_joint", name: joint.name, position });
  };
  let shown = "";
  const slider = h("input", {
    type: "range",
    min: joint.lower,
    max: joint.upper,
    step: "any",
    value: 0,
    disabled: fixed || joint.control === "velocity",
    "aria-label": joint.name,
    title: `${tidy(joint.lower * factor, digits)} to ${tidy(joint.upper * factor, digits)} ${unit}`,
    oninput: () => send(slider.valueAsNumber),
    ondblclick: () => joint.control === "position" && send(0),
  });
  const number = h("input", {
    type: "number",
    step: "any",
    disabled: slider.disabled,
    "aria-label": `${joint.name} in ${unitName}`,
    onchange: () => send(number.valueAsNumber / factor),
    onkeydown: (event: KeyboardEvent) => event.key === "Enter" && number.blur(), // shows the current value again
    onblur: () => {
      if (number.value === "") number.value = shown; // an empty or invalid number changes nothing
    },
  });
  const follows = joint.mimics === "" ? null : h("span", { class: "follows" }, `follows ${joint.mimics}`);
  const name = h(
    "button",
    {
      type: "button",
      class: "name",
      title: joint.name,
      onclick: () => {
        app.selected.set(joint.child);
        if (joint.place) app.show(joint.place);
      },
    },
    joint.name,
  );
  const limits = fixed
    ? null
    : h(
        "span",
        { class: "limits", "aria-hidden": "true" },
        h("span", {}, tidy(joint.lower * factor, digits)),
        h("span", {}, tidy(joint.upper * factor, digits)),
      );
  const speed = joint.control === "velocity" ? speedSlider(app, joint, factor, digits, unit) : null;
  const element = h(
    "div",
    { class: "joint", "data-joint": joint.name },
    name,
    h("span", { class: "value" }, number, unit),
    follows,
    slider,
    limits,
    speed,
  );
  const show = (position: number): void => {
    const before = shown;
    shown = rounded(position * factor, digits);
    if (shown !== before) slider.setAttribute("aria-valuetext", `${shown} ${unitName}`);
    if (document.activeElement !== number && number.value !== shown) number.value = shown;
  };
  const isHeld = sliderHold(slider, () => app.state.value !== null && update([result], app.state.value));
  const result: Row = { joint, index, element, slider, show, isHeld };
  return result;
}

/** A slider for a joint's speed, up to its limit. A double click stops the joint. */
function speedSlider(app: App, joint: JointView, factor: number, digits: number, unit: string): HTMLElement {
  const readoutValue = readout("Speed");
  const slider = h("input", {
    type: "range",
    min: -joint.speed,
    max: joint.speed,
    step: "any",
    value: 0,
    "aria-label": `${joint.name} speed`,
  });
  const show = (): void => {
    readoutValue.textContent = `${rounded(slider.valueAsNumber * factor, digits)} ${unit}/s`;
    slider.setAttribute("aria-valuetext", readoutValue.textContent);
    slider.style.setProperty("--at", String((slider.valueAsNumber + joint.speed) / (2 * joint.speed)));
  };
  const send = (): void => {
    show();
    app.send({ type: "joint_speed", name: joint.name, velocity: slider.valueAsNumber });
  };
  slider.addEventListener("input", send);
  slider.addEventListener("dblclick", () => {
    slider.value = "0";
    send();
  });
  show();
  return h("label", { class: "speed" }, h("span", {}, "Speed"), readoutValue, slider);
}

function update(rows: Row[], state: State): void {
  for (const { joint, index, slider, show, isHeld } of rows) {
    const position = state.positions[index] ?? 0;
    const wrapped = joint.kind === "continuous" ? wrap(position) : position;
    show(wrapped);
    const span = joint.upper - joint.lower;
    const isNew = Math.abs(slider.valueAsNumber - wrapped) > UNSEEN * span;
    if (isNew && !isHeld()) slider.value = String(wrapped);
    slider.style.setProperty("--at", ((slider.valueAsNumber - joint.lower) / span).toFixed(4));
  }
}

/** Factor from rad or m, decimals, and the unit's symbol and name. */
export function unitOf(joint: JointView, radians: boolean): [number, number, string, string] {
  if (joint.kind === "prismatic") return radians ? [1, 4, "m", "metres"] : [1000, 1, "mm", "millimetres"];
  return radians ? [1, 3, "rad", "radians"] : [180 / Math.PI, 1, "°", "degrees"];
}

export function tidy(value: number, digits: number): string {
  return String(Number(value.toFixed(digits))).replace("-", "\u2212");
}
