import type { App } from "../app";
import { h, readout, write } from "../dom";
import { letGo } from "../focus";
import { icon } from "../icons";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];

/** The transport bar: pause, step, reset, time and speed. */
export function transport(app: App): HTMLElement {
  const pause = h("button", {
    type: "button",
    class: "icon-button",
    onclick: () => app.send({ type: "pause", paused: !app.state.value?.paused }),
  });
  const step = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Step by 0.1 s (.)",
      "aria-label": "Step",
      onclick: () => app.send({ type: "advance", seconds: 0.1 }),
    },
    icon("step"),
  );
  const reset = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Reset (R)",
      "aria-label": "Reset",
      onclick: () => app.send({ type: "reset" }),
    },
    icon("reset"),
  );
  const time = readout("Simulated time in seconds", { class: "time" });
  const speed = h(
    "select",
    { "aria-label": "Speed", title: "Simulated seconds per second" },
    ...SPEEDS.map((factor) => h("option", { value: factor }, `${factor}×`)),
  );
  speed.addEventListener("change", () => {
    app.send({ type: "set_speed", factor: Number(speed.value) });
    letGo(speed);
  });
  const plot = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Plots (L)",
      "aria-label": "Plots",
      onclick: () => app.plots.set(!app.plots.value),
    },
    icon("plot"),
  );
  app.plots.watch((open) => plot.setAttribute("aria-pressed", String(open)));
  const traffic = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Topics and log (Y)",
      "aria-label": "Topics and log",
      onclick: () => app.traffic.set(!app.traffic.value),
    },
    icon("list"),
  );
  app.traffic.watch((open) => traffic.setAttribute("aria-pressed", String(open)));
  const rate = h("span", { class: "rate", title: "Real-time factor" });
  let isPaused: boolean | null = null;
  app.state.watchThrottled((state) => {
    if (state === null) return;
    write(time, `${state.time.toFixed(2)} s`);
    if (document.activeElement !== speed) speed.value = String(state.speed);
    write(rate, state.paused ? "paused" : `${state.rate.toFixed(2)}× real time`);
    if (state.paused === isPaused) return;
    isPaused = state.paused;
    pause.replaceChildren(icon(isPaused ? "play" : "pause"));
    pause.title = isPaused ? "Continue (P)" : "Pause (P)";
    pause.setAttribute("aria-label", isPaused ? "Continue" : "Pause");
  });
  const bar = h(
    "div",
    { class: "transport", role: "toolbar", "aria-label": "Simulated time" },
    pause,
    step,
    reset,
    time,
    speed,
    rate,
    plot,
    traffic,
  );
  app.about.watch((about) => {
    bar.hidden = (about?.mode ?? "view") === "view";
  });
  return bar;
}
