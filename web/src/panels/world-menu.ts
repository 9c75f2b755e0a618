import type { App } from "../app";
import { h } from "../dom";
import { icon } from "../icons";
import type { Disturb } from "../protocol";

type Kind = Disturb["fault"];

/** What may go wrong: its name, what it befalls, and its number: what that is, the unit, the usual value. */
const FAULTS: Record<Kind, { label: string; on: "link" | "joint" | "topic" | null; number: readonly [string, string, number] | null }> = {
  slip: { label: "A link slips", on: "link", number: ["Friction", "", 0.1] },
  payload: { label: "A load", on: "link", number: ["Mass", "kg", 0.5] },
  blocked: { label: "A joint is blocked", on: "joint", number: null },
  silent: { label: "A topic is silent", on: "topic", number: null },
  kick: { label: "A kick", on: null, number: ["Speed", "m/s", 0.5] },
};

/** A button that opens what one does with a whole world: its parameters, resets, and what goes wrong. */
export function worldMenu(app: App): HTMLElement {
  const menu = h("div", { class: "menu", id: "world-menu", popover: "auto", role: "dialog", "aria-label": "World and faults" });
  const button = h("button", { type: "button", class: "icon-button", popovertarget: menu.id, title: "World and faults", "aria-label": "World and faults" }, icon("sliders"));
  menu.append(parametersOf(app, () => menu.hidePopover()), resets(app), faults(app));
  const holder = h("span", { class: "world-menu" }, button, menu);
  app.about.watch((about) => (holder.hidden = about?.mode !== "sim"));
  return holder;
}

function parametersOf(app: App, done: () => void): HTMLElement {
  const fields = h("div", { class: "fields" });
  const title = h("h2", {});
  let shown = "";
  app.about.watch((about) => {
    const choice = about?.worlds.find(({ name }) => name === about.world);
    if (about === null || shown === about.world) return;
    shown = about.world;
    title.textContent = shown.replaceAll("_", " ");
    fields.replaceChildren(
      ...(choice?.parameters ?? []).map(({ name, value, is_whole }) => h("label", {}, name, h("input", { type: "number", name, value, step: is_whole ? 1 : "any", required: true }))),
    );
  });
  const form = h("form", {}, title, fields, h("button", { class: "primary", type: "submit" }, "Start"));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const values = [...fields.querySelectorAll("input")].map((input) => `${input.name}=${input.value}`).join(",");
    app.send({ type: "set_world", world: values === "" ? shown : `${shown}:${values}` });
    done();
  });
  return form;
}

function resets(app: App): HTMLElement {
  const part = (what: "world" | "time", label: string, title: string): HTMLElement => h("button", { type: "button", title, onclick: () => app.send({ type: "reset_part", what }) }, label);
  return h(
    "div",
    { class: "menu-part", role: "group", "aria-label": "Start again" },
    h("h2", {}, "Start again"),
    h("div", { class: "row" }, part("world", "All but time", "Everything back to its start; time goes on"), part("time", "Time alone", "Time 0; everything else goes on")),
  );
}

function faults(app: App): HTMLElement {
  const kind = h("select", { "aria-label": "Fault" }, ...Object.entries(FAULTS).map(([name, { label }]) => h("option", { value: name }, label)));
  const target = h("select", { "aria-label": "Befalls" });
  const value = h("input", { type: "number", step: "any", required: true });
  const unit = h("span", { class: "unit" });
  const seconds = h("input", { type: "number", min: 0.01, max: 3600, step: "any", value: 5, required: true, "aria-label": "Seconds" });
  const what = h("span", {});
  const number = h("label", {}, what, h("span", {}, value, unit));
  const lasting = h("label", {}, "for", h("span", {}, seconds, h("span", { class: "unit" }, "s")));
  const chosen = (): (typeof FAULTS)[Kind] => FAULTS[kind.value as Kind];
  const fill = (): void => {
    const scene = app.scene.value;
    const names = { link: scene?.links.map((link) => link.name), joint: scene?.joints.map((joint) => joint.name), topic: app.topics.list.value.filter((topic) => !topic.is_input).map((topic) => topic.name) };
    const before = target.value;
    const { on } = chosen();
    target.replaceChildren(...((on === null ? [] : names[on]) ?? []).map((name) => h("option", { value: name }, name)));
    if ([...target.options].some((option) => option.value === before)) target.value = before;
    target.hidden = on === null;
  };
  const show = (): void => {
    const about = chosen().number;
    number.hidden = about === null;
    lasting.hidden = kind.value === "kick";
    [what.textContent, unit.textContent, value.value] = [about?.[0] ?? "", about?.[1] ?? "", String(about?.[2] ?? 0)];
    fill();
  };
  kind.addEventListener("change", show);
  app.scene.watch(fill);
  app.topics.list.watch(fill);
  show();
  const form = h("form", {}, h("h2", {}, "Let something go wrong"), h("div", { class: "row" }, kind, target), h("div", { class: "fields" }, number, lasting), h("button", { type: "submit", class: "stop" }, "Let it happen"));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    app.send({ type: "disturb", fault: kind.value as Kind, target: target.value, value: value.valueAsNumber, seconds: seconds.valueAsNumber });
    const { label, on } = chosen();
    app.told.set({ text: on === null ? `${label} was given.` : `${label}: ${target.value}, for ${seconds.value} s.` });
  });
  return form;
}
