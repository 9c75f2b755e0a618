import { BoxGeometry, Box3, EdgesGeometry, LineBasicMaterial, LineSegments } from "three";

import type { App } from "../app";
import { h } from "../dom";
import { icon } from "../icons";
import { Signal } from "../signal";
import { SELECTED } from "../view/palette";
import type { View } from "../view/view";
import { goalStatus } from "./goal";
import type { ToolBox } from "./toolbox";

/** Pixels that the pointer may move during a click. */
const STILL = 4;

/** The tool bar, and below the view the hint of the active tool, the state of the goal, and other bars: the selected object
 * and the hint on driving. */
export function toolBar(app: App, box: ToolBox, ...others: HTMLElement[]): HTMLElement[] {
  const buttons = box.tools.map((tool) => {
    const button = h(
      "button",
      {
        type: "button",
        title: `${tool.label} (${tool.key.toUpperCase()})`,
        "aria-label": tool.label,
        "data-tool": tool.name,
        onclick: () => box.choose(tool),
      },
      icon(tool.image),
      h("span", {}, tool.label),
    );
    box.active.watch((active) => button.setAttribute("aria-pressed", String(active === tool)));
    return button;
  });
  const bar = h(
    "div",
    { class: "chips tools", role: "toolbar", "aria-label": "Tools", "aria-orientation": "vertical" },
    ...buttons,
  );
  app.about.watch(() =>
    buttons.forEach((button, index) => (button.hidden = !box.isOffered(box.tools[index]!))),
  );
  const hint = h("div", { class: "hint chip-bar", hidden: true });
  box.active.watch((tool) => {
    hint.hidden = tool.press === undefined;
    const leave = h(
      "button",
      {
        type: "button",
        class: "icon-button",
        title: "Leave the tool (Escape)",
        "aria-label": "Leave the tool",
        onclick: () => box.leave(),
      },
      icon("close"),
    );
    hint.replaceChildren(
      icon(tool.image),
      ...(tool.options === undefined ? [] : [tool.options]),
      h("span", { role: "status", class: "words" }, tool.hint),
      leave,
    );
  });
  return [bar, h("div", { class: "chip-bars" }, hint, goalStatus(app), ...others)];
}

/** Selects the object of the world that is clicked. Delete removes it. */
export function bodyChoice(
  app: App,
  view: View,
  box: ToolBox,
): { element: HTMLElement; remove: () => void; leave: () => void } {
  const body = new Signal("");
  const name = h("span", { role: "status" });
  const remove = (): void => {
    if (body.value !== "") app.send({ type: "delete", name: body.value });
  };
  const leave = (): void => body.set("");
  const frame = new LineSegments(
    new EdgesGeometry(new BoxGeometry(1, 1, 1)),
    new LineBasicMaterial({ color: SELECTED, depthTest: false, transparent: true }),
  );
  frame.visible = false;
  frame.renderOrder = 19;
  view.marks.add(frame);
  const place = (): void => {
    const around = body.value === "" ? null : (view.bodies?.boxOf(indexOf(app, body.value)) ?? null);
    frame.visible = around !== null && !around.isEmpty();
    if (around !== null) span(frame, around);
  };
  const element = h(
    "div",
    { class: "chosen chip-bar", hidden: true },
    icon("box"),
    name,
    h("button", { type: "button", title: "Remove from the world (Delete)", onclick: remove }, "Delete"),
    h(
      "button",
      {
        type: "button",
        class: "icon-button",
        title: "Clear the selection (Escape)",
        "aria-label": "Clear the selection",
        onclick: leave,
      },
      icon("close"),
    ),
  );
  body.watch((now) => {
    name.textContent = now;
    element.hidden = now === "";
    place();
    view.invalidate();
  });
  app.scene.watch((scene) => {
    if (!scene?.bodies.some((candidate) => candidate.name === body.value)) leave();
  });
  view.stage.onFrame(place);
  const canvas = view.stage.renderer.domElement;
  let down: PointerEvent | null = null;
  canvas.addEventListener("pointerdown", (event) => (down = event.button === 0 ? event : null));
  canvas.addEventListener("pointerup", (event) => {
    if (
      down === null ||
      app.about.value?.mode !== "sim" ||
      Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) > STILL
    )
      return;
    down = null;
    body.set(box.picker.at(event.clientX, event.clientY)?.body ?? "");
  });
  return { element, remove, leave };
}

function indexOf(app: App, body: string): number {
  const scene = app.scene.value;
  return (scene?.links.length ?? 0) + (scene?.bodies.findIndex((candidate) => candidate.name === body) ?? 0);
}

function span(frame: LineSegments, around: Box3): void {
  around.getCenter(frame.position);
  around.getSize(frame.scale);
}
