import type { App } from "../app";
import { baseName, h } from "../dom";
import type { View } from "../view/view";
import { formatMass } from "./links";

/** Pixels that the pointer may move during a click. */
const STILL = 4;

/** Shows the name of the link under the pointer. A click selects the link and shows its source. */
export function hover(app: App, view: View, holder: HTMLElement): HTMLElement {
  const tip = h("div", { class: "tip", hidden: true, "aria-hidden": "true" });
  const canvas = view.stage.renderer.domElement;
  let pending = false;
  let down: PointerEvent | null = null;
  const name = (event: PointerEvent): string => {
    const box = canvas.getBoundingClientRect();
    return view.linkAt(event.clientX - box.left, event.clientY - box.top);
  };
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons !== 0 || pending || event.pointerType === "touch") return;
    pending = true;
    requestAnimationFrame(() => {
      pending = false;
      const link = app.scene.value?.links.find((candidate) => candidate.name === name(event));
      view.robot?.point(link?.name ?? "");
      tip.hidden = link === undefined;
      canvas.classList.toggle("pointing", link !== undefined);
      if (link === undefined) return;
      const where = link.place ? `${baseName(link.place.file)}:${link.place.line}` : "";
      tip.replaceChildren(
        h("strong", {}, link.name),
        h(
          "span",
          {},
          [link.inertia && formatMass(link.inertia.mass), link.joint && `joint ${link.joint}`]
            .filter(Boolean)
            .join(" · ") || "no mass",
        ),
        h("span", { class: "where" }, where),
      );
      const box = holder.getBoundingClientRect();
      const left = Math.min(event.clientX - box.left + 14, box.width - tip.offsetWidth - 8);
      tip.style.transform = `translate(${left}px, ${event.clientY - box.top + 16}px)`;
    });
  });
  canvas.addEventListener("pointerleave", () => {
    tip.hidden = true;
    view.robot?.point("");
  });
  canvas.addEventListener("pointerdown", (event) => {
    tip.hidden = true;
    down = event.button === 0 ? event : null;
  });
  canvas.addEventListener("pointerup", (event) => {
    if (down === null || Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) > STILL)
      return;
    const link = name(event);
    if (link === "") app.selected.set("");
    else app.selectLink(link, true);
  });
  canvas.addEventListener("dblclick", (event) => {
    const box = canvas.getBoundingClientRect();
    const link = view.linkAt(event.clientX - box.left, event.clientY - box.top);
    if (link !== "") app.focused.set({ link });
  });
  return tip;
}
