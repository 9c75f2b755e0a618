import type { App } from "../app";
import type { Property } from "../displays/kinds";
import { kindOf, type Value } from "../displays/set";
import { h } from "../dom";
import { icon } from "../icons";

/** A field for one property of a display. `show` sets its value. */
export interface Field {
  element: HTMLElement;
  show: (value: Value) => void;
}

/** Creates the field for a property. */
export function propertyField(
  app: App,
  owner: { kind: string; name: string },
  property: Property,
  change: (value: Value) => void,
): Field {
  const label = `${property.label} of ${owner.name}`;
  const [control, show] = editor(app, owner.kind, property, label, change);
  const unit = property.unit === "" ? null : h("span", { class: "unit" }, property.unit);
  return {
    element: h(
      "div",
      { class: "property", "data-property": property.name },
      h("span", {}, property.label),
      h("span", { class: "value" }, control, unit),
    ),
    show,
  };
}

function editor(
  app: App,
  kind: string,
  property: Property,
  label: string,
  change: (value: Value) => void,
): [HTMLElement, (value: Value) => void] {
  switch (property.kind) {
    case "switch": {
      const box = h("input", { type: "checkbox", "aria-label": label, onchange: () => change(box.checked) });
      return [box, (value) => (box.checked = value === true)];
    }
    case "number":
      return numberField(property, label, change);
    case "colour":
      return colourField(property, label, change);
    case "choice":
      return list(label, () => property.options.map((option) => [option, option]), change);
    case "text": {
      const field = h("input", { type: "text", "aria-label": label, oninput: () => change(field.value) });
      return [field, (value) => document.activeElement !== field && (field.value = String(value))];
    }
    case "topic": {
      const types = kindOf(kind).topics;
      const names = (): [string, string][] =>
        app.topics.list.value.filter((topic) => types.includes(topic.kind)).map(({ name }) => [name, name]);
      return list(label, () => [["", "first available"], ...names()], change);
    }
    case "frame":
      return list(
        label,
        () => [["", "fixed frame"], ...app.frames().map((name): [string, string] => [name, name])],
        change,
      );
  }
}

function numberField(
  property: Property,
  label: string,
  change: (value: Value) => void,
): [HTMLElement, (value: Value) => void] {
  let shown = "";
  const field = h("input", {
    type: "number",
    step: "any",
    min: property.low,
    max: property.high,
    placeholder: property.zero,
    "aria-label": label,
    onchange: () => {
      const value = field.value === "" && property.zero !== "" ? 0 : field.valueAsNumber;
      if (Number.isFinite(value)) change(Math.min(property.high, Math.max(property.low, value)));
      field.value = shown; // an empty or invalid number changes nothing
    },
  });
  return [
    field,
    (value) => {
      shown = value === 0 && property.zero !== "" ? "" : String(Number(Number(value).toPrecision(6)));
      if (document.activeElement !== field) field.value = shown;
    },
  ];
}

/** A field for a colour. An empty colour is the theme's. */
function colourField(
  property: Property,
  label: string,
  change: (value: Value) => void,
): [HTMLElement, (value: Value) => void] {
  const field = h("input", { type: "color", "aria-label": label, oninput: () => change(field.value) });
  const back = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Reset to default",
      "aria-label": `Reset ${label} to default`,
      onclick: () => change(property.initial),
    },
    icon("undo"),
  );
  return [
    h("span", { class: "colour" }, back, field),
    (value) => {
      field.value = String(value) || "#808080";
      field.classList.toggle("unset", value === "");
      back.hidden = value === property.initial;
    },
  ];
}

/** A list with changing entries. It keeps the selected value even if that is not an entry now. */
function list(
  label: string,
  entries: () => [string, string][],
  change: (value: Value) => void,
): [HTMLSelectElement, (value: Value) => void] {
  const field = h("select", { "aria-label": label, onchange: () => change(field.value) });
  return [
    field,
    (value) => {
      const options = entries();
      const all = options.some(([entry]) => entry === value)
        ? options
        : [...options, [String(value), String(value)] as const];
      const names = all.map(([entry]) => entry).join("\n");
      if (field.dataset["entries"] !== names) {
        field.dataset["entries"] = names;
        field.replaceChildren(...all.map(([entry, text]) => h("option", { value: entry }, text)));
      }
      field.value = String(value);
      field.title = field.selectedOptions[0]?.text ?? "";
    },
  ];
}
