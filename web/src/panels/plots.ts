import type uPlot from "uplot";

import type { App } from "../app";
import { download, h } from "../dom";
import { fields, type Field, type History } from "../history";
import { icon } from "../icons";
import type { Scene } from "../protocol";
import { DRAGGED } from "./topics";

const COLOURS = ["--plot-1", "--plot-2", "--plot-3", "--plot-4", "--plot-5", "--plot-6"];
const EVERY = 80;
const SPAN = 20;

/** Fields of the state against simulated time; uPlot is fetched when the panel is first opened. */
export function plots(app: App, history: History): HTMLElement {
  const holder = h("div", { class: "plot" });
  const add = h("select", { "aria-label": "Plot another field" });
  const chips = h("div", { class: "series" });
  const save = h("button", { type: "button", class: "icon-button", title: "Save as CSV", "aria-label": "Save as CSV", onclick: () => download(csv(chosen, history), "kbot.csv") }, icon("save"));
  const close = h("button", { type: "button", class: "icon-button", title: "Close the plots (L)", "aria-label": "Close the plots", onclick: () => app.plots.set(false) }, icon("close"));
  const dock = h("section", { id: "plots", class: "panel", "aria-label": "Plots", hidden: true }, h("header", { class: "panel-head" }, chips, add, save, close), holder);

  let all: Field[] = [];
  let chosen: Field[] = [];
  let chart: uPlot | null = null;
  let drawnAt = 0;
  let asked = 0;

  const choose = (names: string[]): void => {
    remember(names);
    show(names);
  };
  const show = (names: string[]): void => {
    chosen = names.flatMap((name) => all.find((field) => field.name === name) ?? []);
    chips.replaceChildren(...chosen.map((field, index) => chip(field, index, () => choose(names.filter((name) => name !== field.name)))));
    const rest = all.filter((field) => !names.includes(field.name));
    add.replaceChildren(h("option", { value: "" }, "Add…"), ...groups(rest));
    void rebuild();
  };
  add.addEventListener("change", () => {
    choose([...chosen.map((field) => field.name), add.value].slice(-COLOURS.length));
    add.blur();
  });
  const rebuild = async (): Promise<void> => {
    chart?.destroy();
    chart = null; // nothing is drawn with other series than it was made for
    if (!app.plots.value) return;
    const wanted = (asked += 1);
    const { default: UPlot } = await import("./chart");
    if (wanted !== asked || !app.plots.value) return;
    chart = new UPlot(options(holder, chosen), data(chosen, history), holder);
  };
  const draw = (): void => {
    if (!app.plots.value || chart === null || performance.now() - drawnAt < EVERY) return;
    drawnAt = performance.now();
    chart.setData(data(chosen, history));
  };

  let joints: Scene["joints"] | undefined;
  app.scene.watch((scene) => {
    if (scene === null || scene.joints === joints) return;
    joints = scene.joints;
    all = [...fields(scene), ...app.topicFields.value];
    show(remembered());
  });
  app.topicFields.watch((of) => {
    const newest = of.at(-1)?.name;
    if (newest === undefined) return;
    all = [...fields(app.scene.value), ...of];
    const others = chosen.map((field) => field.name).filter((name) => name !== newest);
    choose([...others, newest].slice(-COLOURS.length));
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
  app.state.watch(draw);
  app.theme.watch(() => void rebuild());
  app.plots.watch((open) => {
    dock.hidden = !open;
    void rebuild();
  });
  new ResizeObserver(() => chart?.setSize(size(holder))).observe(holder);
  return dock;
}

function chip(field: Field, index: number, remove: () => void): HTMLElement {
  const button = h("button", { type: "button", class: "chip", title: `Remove ${field.name}`, onclick: remove }, field.name, field.unit && h("span", { class: "unit" }, field.unit));
  button.style.setProperty("--colour", `var(${COLOURS[index % COLOURS.length]})`);
  return button;
}

function groups(rest: Field[]): HTMLElement[] {
  return [...new Set(rest.map((field) => field.group))].map((label) =>
    h("optgroup", { label }, ...rest.filter((field) => field.group === label).map((field) => h("option", { value: field.name }, field.name))),
  );
}

function data(chosen: Field[], history: History): uPlot.AlignedData {
  const end = history.states.at(-1)?.time ?? 0;
  const shown = history.states.filter((state) => state.time > end - SPAN);
  return [shown.map((state) => state.time), ...chosen.map((field) => shown.map((state) => known(field.value(state))))];
}

/** What is not known is not drawn. */
function known(value: number): number | null {
  return Number.isNaN(value) ? null : value;
}

function options(holder: HTMLElement, chosen: Field[]): uPlot.Options {
  const colour = (name: string): string => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const font = `11px ${colour("--mono")}`;
  const axis = { stroke: colour("--quiet"), font, grid: { stroke: colour("--line"), width: 1 }, ticks: { show: false } };
  return {
    ...size(holder),
    legend: { show: false },
    cursor: { y: false },
    scales: { x: { time: false } },
    axes: [{ ...axis, size: 28, values: (_, ticks) => ticks.map((tick) => `${Number(tick.toFixed(2))} s`) }, { ...axis, size: 54 }],
    series: [{}, ...chosen.map((field, index) => ({ label: field.name, stroke: colour(COLOURS[index % COLOURS.length]!), width: 1.5, points: { show: false } }))],
  };
}

function size(holder: HTMLElement): { width: number; height: number } {
  return { width: Math.max(120, holder.clientWidth), height: Math.max(60, holder.clientHeight) };
}

function csv(chosen: Field[], history: History): Blob {
  const quoted = (text: string): string => `"${text.replaceAll('"', '""')}"`;
  const head = ["time [s]", ...chosen.map((field) => field.name + (field.unit && ` [${field.unit}]`))].map(quoted).join(",");
  const rows = history.states.map((state) => [state.time, ...chosen.map((field) => field.value(state))].join(","));
  return new Blob([[head, ...rows].join("\n"), "\n"], { type: "text/csv" });
}

const KEY = "kbot.plots";

function remembered(): string[] {
  try {
    const value: unknown = JSON.parse(localStorage.getItem(KEY) ?? "null");
    if (Array.isArray(value)) return value.filter((name) => typeof name === "string");
  } catch {
    // storage is off, or holds something else
  }
  return ["forward speed", "forward speed asked", "turning speed"];
}

function remember(names: string[]): void {
  try {
    localStorage.setItem(KEY, JSON.stringify(names));
  } catch {
    // storage is off: nothing is remembered
  }
}
