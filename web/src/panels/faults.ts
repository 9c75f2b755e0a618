import type { App } from "../app";
import { h, write } from "../dom";
import { icon } from "../icons";
import type { Disturb, FaultView } from "../protocol";

type Kind = Disturb["fault"];

/** The kinds of faults: label, type of target, and value (label, unit, default) if there is one. */
const FAULTS: Record<
  Kind,
  { label: string; on: "link" | "joint" | "topic"; number: readonly [string, string, number] | null }
> = {
  slip: { label: "Slipping link", on: "link", number: ["Friction", "", 0.1] },
  payload: { label: "Payload", on: "link", number: ["Mass", "kg", 0.5] },
  blocked: { label: "Blocked joint", on: "joint", number: null },
  silent: { label: "Silent topic", on: "topic", number: null },
};

/** The form that injects a fault. */
export function faultForm(app: App): HTMLElement {
  const kind = h(
    "select",
    { "aria-label": "Fault" },
    ...Object.entries(FAULTS).map(([name, { label }]) => h("option", { value: name }, label)),
  );
  const target = h("select", { "aria-label": "Target" });
  const value = h("input", { type: "number", step: "any", required: true });
  const unit = h("span", { class: "unit" });
  const seconds = h("input", {
    type: "number",
    min: 0.01,
    max: 3600,
    step: "any",
    value: 5,
    required: true,
    "aria-label": "Seconds",
  });
  const what = h("span", {});
  const number = h("label", {}, what, h("span", {}, value, unit));
  const lasting = h("label", {}, "for", h("span", {}, seconds, h("span", { class: "unit" }, "s")));
  const chosen = (): (typeof FAULTS)[Kind] => FAULTS[kind.value as Kind];
  const fill = (): void => {
    const scene = app.scene.value;
    const names = {
      link: scene?.links.filter((link) => link.inertia !== null).map((link) => link.name),
      joint: scene?.joints.map((joint) => joint.name),
      topic: app.topics.list.value.filter((topic) => !topic.is_input).map((topic) => topic.name),
    };
    const before = target.value;
    target.replaceChildren(...(names[chosen().on] ?? []).map((name) => h("option", { value: name }, name)));
    if ([...target.options].some((option) => option.value === before)) target.value = before;
  };
  const show = (): void => {
    const about = chosen().number;
    number.hidden = about === null;
    [what.textContent, unit.textContent, value.value] = [
      about?.[0] ?? "",
      about?.[1] ?? "",
      String(about?.[2] ?? 0),
    ];
    fill();
  };
  kind.addEventListener("change", show);
  app.scene.watch(fill);
  app.topics.list.watch(fill);
  show();
  const form = h(
    "form",
    {},
    h("h2", {}, "Inject a fault"),
    h("div", { class: "row" }, kind, target),
    h("div", { class: "fields" }, number, lasting),
    h("button", { type: "submit", class: "stop" }, "Inject"),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    app.send({
      type: "disturb",
      fault: kind.value as Kind,
      target: target.value,
      value: value.valueAsNumber,
      seconds: seconds.valueAsNumber,
    });
    app.notice.set({ text: `${chosen().label}: ${target.value}, for ${seconds.value} s.` });
  });
  return form;
}

/** The list of active and scheduled faults, each with its time and a button to end it. Calls `counted` with the number
 * of active faults. */
export function faultList(app: App, counted: (active: number) => void): HTMLElement {
  const list = h("ul", { class: "faults" });
  const part = h(
    "div",
    { class: "menu-part", role: "group", "aria-label": "Faults" },
    h("h2", {}, "Faults"),
    list,
  );
  const rows = new Map<number, { row: HTMLElement; left: HTMLElement }>();
  let active = -1;
  const add = ({ number, words }: FaultView): { row: HTMLElement; left: HTMLElement } => {
    const left = h("span", { class: "left" });
    const end = h(
      "button",
      {
        type: "button",
        class: "icon-button",
        title: "End this fault",
        "aria-label": `End: ${words}`,
        onclick: () => app.send({ type: "end_fault", number }),
      },
      icon("close"),
    );
    const made = { row: h("li", {}, h("span", { class: "words" }, words), left, end), left };
    rows.set(number, made);
    list.append(made.row);
    return made;
  };
  app.state.watchThrottled((state) => {
    const faults = state?.faults ?? [];
    for (const [number, { row }] of rows) {
      if (faults.some((fault) => fault.number === number)) continue;
      row.remove();
      rows.delete(number);
    }
    const time = state?.time ?? 0;
    for (const fault of faults) write((rows.get(fault.number) ?? add(fault)).left, timeOf(fault, time));
    part.hidden = faults.length === 0;
    const now = faults.filter(({ start }) => start <= time).length;
    if (now !== active) counted((active = now));
  });
  return part;
}

export function timeOf({ start, stop }: FaultView, time: number): string {
  if (start > time) return `in ${(start - time).toFixed(1)} s`;
  return stop === null ? "permanent" : `${Math.max(0, stop - time).toFixed(1)} s left`;
}
