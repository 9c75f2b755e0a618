import type { App } from "../app";
import { h, panel } from "../dom";
import { focusedByKeyboard } from "../focus";
import { icon } from "../icons";
import type { LinkView, Scene } from "../protocol";

/** The item that a key moves to, by the levels of all items. As in every tree view, left moves to the parent. */
export const STEPS: Readonly<Record<string, (at: number, levels: readonly number[]) => number>> = {
  ArrowDown: (at) => at + 1,
  ArrowUp: (at) => at - 1,
  ArrowLeft: (at, levels) => levels.findLastIndex((level, index) => index < at && level < levels[at]!),
  ArrowRight: (at, levels) => (levels[at + 1]! > levels[at]! ? at + 1 : at),
  Home: () => 0,
  End: (_, levels) => levels.length - 1,
};

/** The Links panel: the tree of links. A click selects a link and shows its source. */
export function links(app: App): HTMLElement {
  const tree = h("ul", { class: "tree", role: "tree", "aria-label": "Links" });
  const count = h("span", { class: "count" });
  const mark = (): void => {
    let first = true;
    for (const item of tree.querySelectorAll<HTMLButtonElement>("button[data-link]")) {
      const on = item.dataset["link"] === app.selected.value;
      item.parentElement?.setAttribute("aria-selected", String(on));
      item.tabIndex = on || (app.selected.value === "" && first) ? 0 : -1;
      if (on) item.scrollIntoView({ block: "nearest" });
      first = false;
    }
  };
  app.scene.watch((scene) => {
    if (scene === null) return;
    count.textContent = String(scene.links.length);
    tree.replaceChildren(...branch(app, scene, scene.root, 1));
    mark();
  });
  app.selected.watch(mark);
  tree.addEventListener("keydown", (event) => {
    const go = STEPS[event.key];
    if (go === undefined || event.shiftKey || event.ctrlKey || !focusedByKeyboard()) return;
    const items = [...tree.querySelectorAll<HTMLButtonElement>("button[data-link]")];
    const levels = items.map((item) => Number(item.parentElement?.ariaLevel));
    event.preventDefault();
    event.stopPropagation();
    items[go(items.indexOf(document.activeElement as HTMLButtonElement), levels)]?.focus();
  });
  return panel("links", "Links", [count], tree);
}

function branch(app: App, scene: Scene, name: string, depth: number): HTMLElement[] {
  const link = scene.links.find((candidate) => candidate.name === name);
  if (link === undefined) return [];
  const children = scene.links
    .filter((candidate) => candidate.parent === name)
    .flatMap((candidate) => branch(app, scene, candidate.name, depth + 1));
  return [item(app, link, depth), ...children];
}

function item(app: App, link: LinkView, depth: number): HTMLElement {
  const mass = link.inertia === null ? "" : formatMass(link.inertia.mass);
  const button = h(
    "button",
    {
      type: "button",
      "data-link": link.name,
      title: describe(link),
      onclick: () => app.selectLink(link.name, true),
      ondblclick: () => app.focused.set({ link: link.name }),
    },
    icon(link.joint === "" ? "box" : "joint"),
    h("span", { class: "name" }, link.name),
    h("span", { class: "mass" }, mass),
  );
  button.style.paddingLeft = `${8 + (depth - 1) * 14}px`;
  return h("li", { role: "treeitem", "aria-level": depth, "aria-selected": "false" }, button);
}

function describe(link: LinkView): string {
  const where = link.place === null ? "" : `${link.place.file}:${link.place.line}`;
  return [link.joint && `joint ${link.joint}`, where].filter(Boolean).join("\n");
}

/** A mass in a readable unit. */
export function formatMass(kilograms: number): string {
  if (kilograms >= 1) return `${Number(kilograms.toPrecision(3))} kg`;
  if (kilograms >= 1e-3) return `${Number((kilograms * 1e3).toPrecision(3))} g`;
  return `${Number((kilograms * 1e6).toPrecision(3))} mg`;
}
