import type { Vector3 } from "three";

import type { App } from "../app";
import { Signal } from "../signal";
import type { View } from "../view/view";
import { KeyCursor } from "./key-cursor";
import { measureTool } from "./measure";
import { Picker } from "./pick";
import { estimateTool, focusTool, goalTool, pointTool } from "./poses";
import { pushTool } from "./push";
import type { Tool } from "./tool";
import { addTool, moveTool } from "./world";

const INTERACT: Tool = {
  name: "interact",
  label: "Interact",
  key: "i",
  image: "pointer",
  hint: "Drag to rotate the view, click to select.",
  simulated: false,
};

/** All tools, one of which is active. */
export class ToolBox {
  readonly tools: readonly Tool[];
  readonly active = new Signal<Tool>(INTERACT);
  readonly picker: Picker;
  private readonly canvas: HTMLCanvasElement;
  private held: AbortController | null = null;
  private waiting = 0;

  constructor(
    private readonly app: App,
    view: View,
  ) {
    this.picker = new Picker(view);
    this.canvas = view.stage.renderer.domElement;
    const pictureFromWorld = (point: Vector3): Vector3 =>
      point.clone().applyMatrix4(this.picker.worldFromPicture().invert());
    this.tools = [
      INTERACT,
      moveTool(app),
      pushTool(app, view),
      goalTool(app, view),
      estimateTool(app, view),
      pointTool(app),
      measureTool(view, pictureFromWorld),
      focusTool(view, pictureFromWorld),
      addTool(app, view),
    ];
    this.canvas.addEventListener("pointerdown", (event) => this.down(event), { capture: true });
    this.canvas.addEventListener(
      "dblclick",
      (event) => this.active.value.press && event.stopImmediatePropagation(),
      { capture: true },
    );
    const keys = new KeyCursor(
      this.canvas,
      this.picker,
      () => this.active.value,
      (tool) => this.up(tool),
    );
    this.canvas.addEventListener("pointermove", (event) => this.hover(event));
    this.canvas.addEventListener("pointerleave", () => this.active.value.hover?.(null));
    this.active.watch((tool) => {
      keys.centre();
      if (tool === INTERACT) delete document.documentElement.dataset["tool"];
      else document.documentElement.dataset["tool"] = tool.name;
    });
  }

  isOffered(tool: Tool): boolean {
    return !tool.simulated || this.app.about.value?.mode === "sim";
  }

  choose(tool: Tool): void {
    if (tool === this.active.value || !this.isOffered(tool)) return;
    this.drop();
    this.active.value.leave?.();
    this.active.set(tool);
  }

  /** Selects a tool by its key. Returns whether there is one. */
  press(key: string): boolean {
    const tool = this.tools.find((candidate) => candidate.key === key && this.isOffered(candidate));
    if (tool !== undefined) this.choose(tool);
    return tool !== undefined;
  }

  /** Switches to the Interact tool. Returns whether another tool was active. */
  leave(): boolean {
    const was = this.active.value !== INTERACT;
    this.choose(INTERACT);
    return was;
  }

  /** Undoes the last step of the tool, or leaves the tool. Returns whether there was anything to do. */
  back(): boolean {
    if (this.held !== null) {
      this.drop();
      return true;
    }
    return this.active.value.back?.() === true || this.leave();
  }

  private hover({ clientX, clientY, pointerType }: PointerEvent): void {
    const { active } = this;
    if (active.value.hover === undefined || this.held !== null || pointerType === "touch") return;
    cancelAnimationFrame(this.waiting);
    this.waiting = requestAnimationFrame(() => active.value.hover?.(this.picker.at(clientX, clientY)));
  }

  private down(event: PointerEvent): void {
    const tool = this.active.value;
    if (tool.press === undefined || event.button !== 0 || event.shiftKey) return;
    event.stopImmediatePropagation();
    event.preventDefault();
    this.canvas.focus({ preventScroll: true });
    if (this.held !== null) return this.drop(); // a second finger
    cancelAnimationFrame(this.waiting);
    const place = this.picker.at(event.clientX, event.clientY);
    if (place === null || !tool.press(place)) return;
    const held = (this.held = new AbortController());
    const options = { signal: held.signal, capture: true };
    const isOurs = (other: PointerEvent): boolean => {
      other.stopPropagation();
      return other.pointerId === event.pointerId;
    };
    addEventListener(
      "pointermove",
      (now) => {
        if (!isOurs(now)) return;
        const point = this.picker.level(now.clientX, now.clientY, place.point.z);
        if (point !== null) tool.drag?.(point);
      },
      options,
    );
    addEventListener("pointerup", (now) => isOurs(now) && this.up(tool), options);
    addEventListener("pointercancel", (now) => isOurs(now) && this.drop(), options);
  }

  private up(tool: Tool): void {
    this.held?.abort();
    this.held = null;
    if (tool.release?.() === true) this.leave();
  }

  /** Cancels the drag. */
  private drop(): void {
    if (this.held === null) return;
    this.held.abort();
    this.held = null;
    this.active.value.cancel?.();
  }
}
