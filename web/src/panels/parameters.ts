import type { App } from "../app";
import { h, ofNow, panel } from "../dom";
import { sliderHold } from "../slider-hold";
import type { Parameter, Parameters } from "../protocol";

interface Row {
  parameter: Parameter;
  element: HTMLElement;
  /** Updates the value shown. */
  show: () => void;
}

/** The Parameters panel: a slider or check box for each numeric or boolean argument and property of the description. The
 * file changes only on Keep. */
export function parameters(app: App): HTMLElement {
  const list = h("div", { class: "parameters" });
  const keep = h(
    "button",
    {
      type: "button",
      title: "Write these values into the file",
      onclick: () => app.send({ type: "keep_parameters" }),
    },
    "Keep",
  );
  const drop = h(
    "button",
    {
      type: "button",
      title: "Restore the values from the file",
      onclick: () => app.send({ type: "drop_parameters" }),
    },
    "Drop",
  );
  const undo = h("button", { type: "button", onclick: () => app.send({ type: "undo" }) }, "Undo");
  const buttons = h("div", { class: "buttons" }, undo, keep, drop);
  let rows: Row[] = [];
  app.parameters.watch((now) => {
    if (now === null) return;
    undo.hidden = now.undo === "";
    undo.title = `Undo: ${now.undo} (Ctrl+Z)`;
    keep.hidden = drop.hidden = !now.parameters.some(isChanged);
    if (!sameNames(rows, now.parameters)) {
      rows = now.parameters.map((parameter) => row(app, parameter));
      list.replaceChildren(
        ...(rows.length
          ? rows.map(({ element }) => element)
          : [h("p", { class: "nothing" }, whyNone(app, now))]),
      );
    }
    now.parameters.forEach((parameter, index) => update(rows[index]!, parameter));
  });
  return panel("parameters", "Parameters", [ofNow(), buttons], list);
}

function whyNone(app: App, { read_only }: Parameters): string {
  if (read_only !== "") return `Read only: ${read_only}.`;
  return app.findings.value?.stale
    ? "Unknown until the file can be read."
    : "The file has no numeric arguments or properties.";
}

function row(app: App, parameter: Parameter): Row {
  const { kind, name } = parameter;
  const title = kind === "arg" ? "argument" : "property";
  const result: Row = {
    parameter,
    element: h("div", { class: "joint", "data-parameter": name }),
    show: () => undefined,
  };
  const label = h(
    "button",
    {
      type: "button",
      class: "name",
      title: `${title} ${name}`,
      onclick: () => app.show(result.parameter.place),
    },
    name,
  );
  const send = (value: number): void => {
    if (Number.isFinite(value)) app.send({ type: "set_parameter", kind, name, value });
  };
  const { value, slider, show } = parameter.is_truth ? checked(result, send) : dragged(result, send);
  const unit = parameter.unit === "" ? null : h("span", { class: "unit" }, parameter.unit);
  result.element.append(label, h("span", { class: "value" }, value, unit), ...slider);
  result.show = show;
  return result;
}

/** The inputs of a row. */
interface Inputs {
  value: HTMLElement;
  slider: HTMLElement[];
  show: () => void;
}

function checked(row: Row, send: (value: number) => void): Inputs {
  const box = h("input", {
    type: "checkbox",
    "aria-label": row.parameter.name,
    onchange: () => send(Number(box.checked)),
  });
  return { value: box, slider: [], show: () => (box.checked = row.parameter.value !== 0) };
}

function dragged(row: Row, send: (value: number) => void): Inputs {
  const { parameter } = row;
  const reach = Math.abs(parameter.written) * 2 || 1;
  const slider = h("input", {
    type: "range",
    min: parameter.written < 0 || parameter.written === 0 ? -reach : 0,
    max: parameter.written < 0 ? 0 : reach,
    step: "any",
    "aria-label": parameter.name,
    oninput: () => send(Number(slider.valueAsNumber.toPrecision(3))),
  });
  const number = h("input", {
    type: "number",
    step: "any",
    "aria-label": `${parameter.name}, as a number`,
    onchange: () => send(number.valueAsNumber),
    onblur: () => show(),
  });
  const isHeld = sliderHold(slider, () => show());
  const show = (): void => {
    const { value } = row.parameter;
    if (document.activeElement !== number) number.value = String(Number(value.toPrecision(6)));
    if (!isHeld()) slider.value = String(value);
    const { min, max } = slider;
    slider.style.setProperty(
      "--at",
      String((slider.valueAsNumber - Number(min)) / (Number(max) - Number(min))),
    );
  };
  return { value: number, slider: [slider], show };
}

function update(row: Row, parameter: Parameter): void {
  row.parameter = parameter;
  row.element.classList.toggle("changed", isChanged(parameter));
  row.show();
}

function isChanged(parameter: Parameter): boolean {
  return parameter.value !== parameter.written;
}

function sameNames(rows: readonly Row[], parameters: readonly Parameter[]): boolean {
  return (
    rows.length > 0 &&
    rows.length === parameters.length &&
    rows.every(({ parameter }, i) => same(parameter, parameters[i]!))
  );
}

function same(a: Parameter, b: Parameter): boolean {
  return a.name === b.name && a.kind === b.kind && a.is_truth === b.is_truth && a.unit === b.unit;
}
