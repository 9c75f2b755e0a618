import type { App } from "../app";
import { kindOf, valueOf, type DisplayConfig } from "../displays/set";
import { h } from "../dom";
import { propertyField } from "./property";

/** A part of a display's settings besides its properties. `show` updates it. */
export interface Extra {
  element: HTMLElement;
  show: (config: DisplayConfig) => void;
}

/** A collapsible part that is filled when it is opened. */
function folded(title: string, fill: (config: DisplayConfig) => Node[]): Extra {
  const body = h("div", { class: "folded" });
  let config: DisplayConfig | null = null;
  const element = h("details", {}, h("summary", {}, title), body);
  const refill = (): void => {
    if (element.open && config !== null) body.replaceChildren(...fill(config));
  };
  element.addEventListener("toggle", refill);
  return {
    element,
    show(now) {
      config = now;
      if (!body.contains(document.activeElement)) refill();
    },
  };
}

/** Visibility and opacity of each link. */
function perLink(app: App): Extra {
  return folded("Links", (config) =>
    (app.scene.value?.links ?? []).map((link) => {
      const fields = kindOf(config.kind).per_link.map((property) => {
        const own = { ...property, name: `${link.name}/${property.name}` };
        const field = propertyField(app, { kind: config.kind, name: link.name }, own, (value) =>
          app.displays.set(config.id, own.name, value),
        );
        field.show(valueOf(config, own));
        return field.element.querySelector(".value")!;
      });
      return h("div", { class: "property link" }, h("span", {}, link.name), ...fields);
    }),
  );
}

/** Whether a camera shows each other display. */
function perDisplay(app: App): Extra {
  return folded("Visibility", (config) =>
    app.displays.all.value
      .filter((other) => other.id !== config.id)
      .flatMap((other) =>
        kindOf(config.kind).per_display.map((property) => {
          const own = { ...property, name: `${other.name}/${property.name}`, label: other.name };
          const field = propertyField(app, config, own, (value) =>
            app.displays.set(config.id, own.name, value),
          );
          field.show(valueOf(config, own));
          return field.element;
        }),
      ),
  );
}

/** Settings of each marker namespace that was received or has stored settings. */
function perNamespace(app: App): Extra {
  return folded("Namespaces", (config) => {
    const set = Object.keys(config.properties).filter((name) => name.includes("/"));
    const names = new Set([
      ...(app.namespaces.value.get(config.id) ?? []),
      ...set.map((name) => name.slice(0, name.lastIndexOf("/"))),
    ]);
    if (names.size === 0) return [h("p", { class: "nothing" }, "No markers received.")];
    return [...names].sort().flatMap((name) =>
      kindOf(config.kind).per_namespace.map((property) => {
        const own = { ...property, name: `${name}/${property.name}`, label: name || "(none)" };
        const field = propertyField(app, config, own, (value) =>
          app.displays.set(config.id, own.name, value),
        );
        field.show(valueOf(config, own));
        return field.element;
      }),
    );
  });
}

/** The tree of frames. */
function frameTree(app: App): Extra {
  return folded("Tree", () => {
    const scene = app.scene.value;
    if (scene === null) return [];
    const parents = new Map<string, string>(scene.links.map((link) => [link.name, link.parent]));
    for (const [name = "", parent = ""] of app.state.value?.frames ?? []) parents.set(name, parent);
    if (scene.world !== scene.root && !parents.get(scene.root)) parents.set(scene.root, scene.world);
    const beneath = (parent: string): HTMLElement[] =>
      [...parents].filter(([, above]) => above === parent).map(([name]) => branch(name));
    const branch = (name: string): HTMLElement => {
      const children = beneath(name);
      return h("li", {}, name, children.length > 0 && h("ul", {}, ...children));
    };
    return [h("ul", { class: "frames" }, branch(scene.world))];
  });
}

/** The extra parts for a kind of display. */
export function extras(app: App, kind: string): Extra[] {
  const { per_link, per_display, per_namespace } = kindOf(kind);
  const parts = [
    ...(per_link.length > 0 ? [perLink(app)] : []),
    ...(per_display.length > 0 ? [perDisplay(app)] : []),
    ...(per_namespace.length > 0 ? [perNamespace(app)] : []),
  ];
  return [...parts, ...(kind === "TF" ? [frameTree(app)] : [])];
}
