import { h } from "../dom";

/** A resizable window over the view that shows an image. */
export class PictureWindow {
  readonly canvas = h("canvas", { width: 4, height: 3, role: "img" });
  private readonly title = h("figcaption", {});
  private readonly frame = h("figure", { class: "camera-view", hidden: true }, this.title, this.canvas);
  /** Width in CSS pixels. */
  width = 0;

  constructor(overlay: HTMLElement, resized: () => void = () => undefined) {
    overlay.append(this.frame);
    new ResizeObserver(([entry]) => {
      this.width = entry!.contentRect.width;
      resized();
    }).observe(this.frame);
  }

  show(on: boolean): void {
    this.frame.hidden = !on;
  }

  get isShown(): boolean {
    return !this.frame.hidden;
  }

  name(title: string, label: string): void {
    this.title.textContent = title;
    this.canvas.setAttribute("aria-label", label);
  }

  remove(): void {
    this.frame.remove();
  }
}
