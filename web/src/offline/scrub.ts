import { h, readout } from "../dom";
import type { State } from "../protocol";

const SECOND = 1000;

/** A slider over recorded states, and a button that plays them back at their original speed. */
export function scrub(states: readonly State[], show: (index: number) => void): HTMLElement {
  const last = states.length - 1;
  const time = readout("Simulated time");
  const slider = h("input", {
    type: "range",
    min: 0,
    max: last,
    step: 1,
    value: last,
    "aria-label": "Recorded state",
    oninput: () => put(slider.valueAsNumber),
  });
  const play = h(
    "button",
    {
      type: "button",
      "aria-pressed": "false",
      onclick: () => run(play.getAttribute("aria-pressed") !== "true"),
    },
    "Play",
  );
  let playing = 0;
  const put = (index: number): void => {
    slider.value = String(index);
    slider.style.setProperty("--at", String(index / last));
    time.textContent = `${(states[index]?.time ?? 0).toFixed(2)} s`;
    slider.setAttribute("aria-valuetext", time.textContent);
    show(index);
  };
  const run = (on: boolean): void => {
    cancelAnimationFrame(playing);
    play.setAttribute("aria-pressed", String(on));
    if (!on) return;
    if (slider.valueAsNumber >= last) put(0);
    const from = states[slider.valueAsNumber]?.time ?? 0;
    const start = performance.now();
    const tick = (now: number): void => {
      const target = from + (now - start) / SECOND;
      const next = states.findIndex((state) => state.time > target);
      put(next < 0 ? last : Math.max(0, next - 1));
      if (next < 0) run(false);
      else playing = requestAnimationFrame(tick);
    };
    playing = requestAnimationFrame(tick);
  };
  put(last);
  return h(
    "div",
    { class: "transport scrub", role: "group", "aria-label": "Recorded states" },
    play,
    slider,
    time,
  );
}
