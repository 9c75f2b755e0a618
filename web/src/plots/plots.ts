import type { App } from "../app";
import { download, h } from "../dom";
import { letGo } from "../focus";
import { icon } from "../icons";
import { DRAGGED } from "../panels/topics";
import { PLOTTED } from "../program-topics";
import type { Scene } from "../protocol";
import { fields, hasStoredFields, labelled, storedFields, storeFields, type Field } from "./fields";
import { Graph, MOST_CURVES, strokeOf } from "./graph";
import { Span, SPANS, type SpanName } from "./span";
import { Table } from "./table";

/** Milliseconds between two drawings. */
const EVERY = 80;

/** The Plots panel: values over time, of the simulation or a recording. uPlot is loaded when it is first opened. */
export function plots(app: App): HTMLElement {
  const holder = h("div", { class: "plot" });
  const add = h("select", { "aria-label": "Plot another field" });
  const chips = h("div", { class: "series" });
  const spans = h(
    "select",
    {
      "aria-label": "Time span",
      title: "Time span of the plot. Drag in the plot to zoom in, double-click to zoom out.",
    },
    ...Object.entries(SPANS).map(([value, text]) => h("option", { value }, text)),
  );
  const close = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Close the plots (L)",
      "aria-label": "Close the plots",
      onclick: () => app.plots.set(false),
    },
    icon("close"),
  );
  const table = new Table(app);
  const span = new Span(app);
  const dock = h(
    "section",
    { id: "plots", class: "panel", "aria-label": "Plots", hidden: true },
    h("header", { class: "panel-head" }, chips, add, spans, saveMenu(app, table, span, holder), close),
    holder,
  );

  let all: Field[] = [];
  let values: HTMLElement[] = [];
  let pointed = -1;
  let drawnAt = 0;

  const showValues = (): void => {
    const played = app.travel.timeline.value?.played === true;
    const at = app.travel.isPast || played ? app.travel.at : Infinity;
    const index = pointed >= 0 ? pointed : table.indexAt(at);
    values.forEach((shown, column) => {
      const value = table.columns[column]?.[index];
      shown.textContent = value == null ? "" : String(Number(value.toPrecision(3)));
    });
  };
  const graph = new Graph(app, holder, table, span, (index) => {
    pointed = index;
    showValues();
  });
  let wasOpened = false;
  const updateSubscriptions = (): void =>
    app.topicFields.value.forEach((field) => field.setActive(wasOpened && table.fields.includes(field)));
  const choose = (names: string[]): void => {
    storeFields(names);
    show(names);
  };
  const show = (names: string[]): void => {
    const chosen = names.flatMap((name) => all.find((field) => field.name === name) ?? []);
    table.choose(chosen);
    updateSubscriptions();
    values = chosen.map(() => h("span", { class: "value" }));
    chips.replaceChildren(
      ...chosen.map((field, index) =>
        chip(field, index, values[index]!, () => choose(names.filter((name) => name !== field.name))),
      ),
    );
    add.replaceChildren(
      h("option", { value: "" }, "Add…"),
      ...groups(all.filter((field) => !names.includes(field.name))),
    );
    void graph.rebuild();
    draw(true);
  };
  add.addEventListener("change", () => {
    choose([...table.fields.map((field) => field.name), add.value].slice(-MOST_CURVES));
    letGo(add);
  });
  spans.addEventListener("change", () => {
    span.choose(spans.value as SpanName);
    letGo(spans);
    draw(true);
  });
  let later: ReturnType<typeof setTimeout> | undefined;
  const draw = (atOnce = false): void => {
    if (!app.plots.value) return;
    const wait = drawnAt + EVERY - performance.now();
    if (!atOnce && wait > 0) {
      later ??= setTimeout(() => draw(true), wait); // the last change is always drawn
      return;
    }
    clearTimeout(later);
    later = undefined;
    drawnAt = performance.now();
    const [low, high] = span.range();
    table.need(Math.max(low, span.start), Math.min(high, span.end));
    graph.draw();
    showValues();
  };

  let joints: Scene["joints"] | undefined;
  app.scene.watch((scene) => {
    if (scene === null || scene.joints === joints) return;
    joints = scene.joints;
    const played = app.about.value?.mode === "play";
    if (played) span.choose("all");
    spans.value = span.name;
    all = [...fields(scene, played), ...app.topicFields.value];
    show(storedFields());
  });
  const restored = app.topicFields.value;
  app.topicFields.watch((of) => {
    const newest = of.at(-1)?.name;
    if (newest === undefined || of === restored) return;
    all = [...fields(app.scene.value, app.about.value?.mode === "play"), ...of];
    // what a program plots replaces the first choice, which the user has not changed
    const isFirst = newest.startsWith(PLOTTED) && !hasStoredFields();
    const others = table.fields.map((field) => field.name).filter((name) => name !== newest);
    choose([...(isFirst ? [] : others), newest].slice(-MOST_CURVES));
  });
  const dragged = (event: DragEvent): boolean => event.dataTransfer?.types.includes(DRAGGED) === true;
  dock.addEventListener("dragover", (event) => {
    if (!dragged(event)) return;
    event.preventDefault();
    dock.classList.add("dropping");
  });
  dock.addEventListener("dragleave", () => dock.classList.remove("dropping"));
  dock.addEventListener("drop", (event) => {
    dock.classList.remove("dropping");
    if (!dragged(event)) return;
    event.preventDefault();
    const [topic, ...path] = JSON.parse(event.dataTransfer!.getData(DRAGGED)) as string[];
    app.plotTopic(topic!, path);
  });
  app.state.watch((state) => {
    if (state !== null && !app.travel.isPast && app.travel.timeline.value?.played !== true) table.add(state);
    draw();
  });
  app.travel.timeline.watch(() => draw());
  app.series.watch((series) => series !== null && table.receive(series) && draw(true));
  app.connection.link.watch((link) => link === "live" && table.forget());
  app.theme.watch(() => void graph.rebuild());
  app.plots.watch((open) => {
    dock.hidden = !open;
    wasOpened ||= open;
    updateSubscriptions();
    table.forget();
    void graph.rebuild();
    draw(true);
  });
  return dock;
}

function chip(field: Field, index: number, value: HTMLElement, remove: () => void): HTMLElement {
  const button = h(
    "button",
    { type: "button", class: "chip", title: `Remove ${field.name}`, onclick: remove },
    field.label ?? field.name,
    value,
    field.unit && h("span", { class: "unit" }, field.unit),
  );
  const { colour, dash } = strokeOf(index);
  button.style.setProperty("--colour", `var(${colour})`);
  button.classList.toggle("dashed", dash.length > 0);
  return button;
}

function groups(rest: Field[]): HTMLElement[] {
  return [...new Set(rest.map((field) => field.group))].map((label) =>
    h(
      "optgroup",
      { label },
      ...rest
        .filter((field) => field.group === label)
        .map((field) => h("option", { value: field.name }, field.name)),
    ),
  );
}

/** The menu that saves the visible part of the plot as CSV or SVG. */
function saveMenu(app: App, table: Table, span: Span, holder: HTMLElement): HTMLElement {
  const name = (): string => `${app.scene.value?.robot || "kbot"}-plot`;
  const csv = (): void => download(table.csv(...span.range()), `${name()}.csv`);
  const svg = (): void => {
    const [start, end] = span.range();
    const { fields: shown } = table;
    const theme = app.theme.value === "light" ? "light" : "dark";
    const box = {
      width: Math.min(8192, Math.max(480, holder.clientWidth)),
      height: Math.min(8192, Math.max(240, holder.clientHeight)),
    };
    app.send({
      type: "draw_plot",
      fields: shown.map((field) => field.key),
      labels: shown.map(labelled),
      start: Math.max(0, start),
      end: Math.max(0, end),
      theme,
      ...box,
    });
  };
  app.plotImage.watch(
    (drawing) =>
      drawing !== null && download(new Blob([drawing.svg], { type: "image/svg+xml" }), `${name()}.svg`),
  );
  const item = (text: string, act: () => void): HTMLElement => {
    const button = h("button", { type: "button" }, text);
    button.addEventListener("click", () => {
      menu.hidePopover();
      act();
    });
    return button;
  };
  const menu = h(
    "div",
    { id: "plot-save", class: "plot-save", popover: "auto", role: "group", "aria-label": "Save the plot" },
    item("Save as CSV", csv),
    item("Save as SVG", svg),
  );
  const open = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      popovertarget: menu.id,
      title: "Save the visible part of the plot",
      "aria-label": "Save the plot",
    },
    icon("save"),
  );
  menu.addEventListener("beforetoggle", () => {
    const { right, bottom } = open.getBoundingClientRect();
    menu.style.right = `${Math.max(8, innerWidth - right)}px`;
    menu.style.bottom = `${Math.max(8, innerHeight - bottom + 30)}px`;
  });
  return h("span", { class: "plot-saving" }, open, menu);
}
