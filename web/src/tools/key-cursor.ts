import type { Picker, Place } from "./pick";
import type { Tool } from "./tool";

/** Pixels that an arrow key moves the cursor. */
const STEP = 8;
const ARROWS: Readonly<Record<string, readonly [number, number]>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

/** Replaces the pointer while the view has the focus. The arrow keys move it and Enter presses. A second Enter releases
 * what is dragged. */
export class KeyCursor {
  private x = 0;
  private y = 0;
  private dragged: { tool: Tool; place: Place } | null = null;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly picker: Picker,
    private readonly active: () => Tool,
    private readonly released: (tool: Tool) => void,
  ) {
    canvas.addEventListener("keydown", (event) => {
      if (
        this.active().press === undefined ||
        event.ctrlKey ||
        event.shiftKey ||
        event.altKey ||
        event.metaKey
      )
        return;
      const arrow = ARROWS[event.key];
      if (arrow !== undefined) this.move(...arrow);
      else if (event.key === "Enter" && !event.repeat) this.press();
      else if (event.key === "Escape" && this.dragged !== null) this.drop();
      else return;
      event.preventDefault();
      event.stopPropagation(); // otherwise the arrow keys would drive the robot
    });
  }

  /** Moves back to the centre of the view, and drops what is dragged. */
  centre(): void {
    this.drop();
    this.x = this.y = 0;
    this.show();
  }

  private move(right: number, down: number): void {
    const { clientWidth, clientHeight } = this.canvas;
    const within = (value: number, size: number): number =>
      Math.min(size / 2 - 1, Math.max(-size / 2 + 1, value));
    this.x = within(this.x + right * STEP, clientWidth);
    this.y = within(this.y + down * STEP, clientHeight);
    this.show();
    const [x, y] = this.onPage();
    if (this.dragged === null) return this.active().hover?.(this.picker.at(x, y));
    const point = this.picker.level(x, y, this.dragged.place.point.z);
    if (point !== null) this.dragged.tool.drag?.(point);
  }

  private press(): void {
    const tool = this.active();
    if (this.dragged !== null) {
      this.dragged = null;
      return this.released(tool);
    }
    const place = this.picker.at(...this.onPage());
    if (place === null || tool.press?.(place) !== true) return;
    if (tool.drag === undefined) this.released(tool);
    else this.dragged = { tool, place };
  }

  private drop(): void {
    this.dragged?.tool.cancel?.();
    this.dragged = null;
  }

  private onPage(): [number, number] {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    return [left + width / 2 + this.x, top + height / 2 + this.y];
  }

  private show(): void {
    const { style } = this.canvas.parentElement!;
    style.setProperty("--cursor-x", `${this.x}px`);
    style.setProperty("--cursor-y", `${this.y}px`);
  }
}
