import type { App } from "../app";
import { h, panel } from "../dom";
import type { JointView, State } from "../protocol";

interface Row {
  joint: JointView;
  slider: HTMLInputElement;
  show: (position: number) => void;
}

/** A slider and a number for each joint; while something is simulated they show what it does. */
export function joints(app: App): HTMLElement {
  const list = h("div", { class: "joints" });
  const preset = (kind: "zero" | "centre" | "random", label: string): HTMLButtonElement =>
    h("button", { type: "button", title: `All joints: ${label.toLowerCase()}`, onclick: () => app.send({ type: "set_joints", preset: kind }) }, label);
  const presets = h("div", { class: "buttons" }, preset("zero", "Zero"), preset("centre", "Centre"), preset("random", "Random"));
  let rows: Row[] = [];
  app.scene.watch((scene) => {
    const live = app.about.value?.mode === "sim";
    presets.hidden = live || !scene?.joints.length;
    rows = (scene?.joints ?? []).map((joint) => row(app, joint, live || joint.mimics !== ""));
    list.replaceChildren(...(rows.length ? rows.map((one) => one.slider.closest<HTMLElement>(".joint")!) : [h("p", { class: "nothing" }, "No joint moves.")]));
  });
  app.state.watch((state) => state && update(rows, state));
  return panel("joints", "Joints", [presets], list);
}

function row(app: App, joint: JointView, fixed: boolean): Row {
  const turns = joint.kind !== "prismatic";
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
    disabled: fixed,
    "aria-label": joint.name,
    oninput: () => send(slider.valueAsNumber),
    ondblclick: () => send(0),
  });
  const number = h("input", {
    type: "number",
    step: "any",
    disabled: fixed,
    "aria-label": `${joint.name} in ${turns ? "degrees" : "millimetres"}`,
    onchange: () => send(number.valueAsNumber / scale(joint)),
    onblur: () => {
      if (number.value === "") number.value = shown; // what is empty, or no number, sets nothing
    },
  });
  const name = h("button", { type: "button", class: "name", title: joint.mimics ? `follows ${joint.mimics}` : joint.name, onclick: () => {
    app.selected.set(joint.child);
    if (joint.place) app.show(joint.place);
  } }, joint.name);
  h("div", { class: "joint", "data-joint": joint.name }, name, h("span", { class: "value" }, number, turns ? "°" : "mm"), slider);
  const show = (position: number): void => {
    shown = (position * scale(joint)).toFixed(1);
    if (document.activeElement !== number) number.value = shown;
  };
  return { joint, slider, show };
}

function update(rows: Row[], state: State): void {
  rows.forEach(({ joint, slider, show }, index) => {
    const position = state.positions[index] ?? 0;
    const wrapped = joint.kind === "continuous" ? wrap(position) : position;
    show(wrapped);
    if (!slider.matches(":active")) slider.value = String(wrapped);
    slider.style.setProperty("--at", String((slider.valueAsNumber - joint.lower) / (joint.upper - joint.lower)));
  });
}

function scale(joint: JointView): number {
  return joint.kind === "prismatic" ? 1000 : 180 / Math.PI;
}

function wrap(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}
