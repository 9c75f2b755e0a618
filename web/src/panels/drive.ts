import { wrap, yawOf } from "../angles";
import type { App } from "../app";
import type { Driver } from "../drive-keys";
import { h, panel, readout, rounded, write } from "../dom";
import type { State } from "../protocol";

/** Odometry errors in m and rad above which the true pose is highlighted: those that are visible in the view. */
const FAR = 0.005;
const TURNED = Math.PI / 180;

/** The Drive panel: a pad for touch or pointer, the speed limit, commanded and actual speeds, and the robot's pose. */
export function drive(app: App, driver: Driver): HTMLElement {
  const why = h("p", { class: "nothing" });
  const knob = h("span", { class: "knob" });
  const mark = (className: string): HTMLElement =>
    h("span", { class: `arrow ${className}`, "aria-hidden": "true" });
  const pad = h(
    "div",
    { class: "pad", role: "application", "aria-label": "Drive: drag, or hold W A S D or the arrow keys" },
    mark("up"),
    mark("down"),
    mark("left"),
    mark("right"),
    knob,
  );
  usePad(pad, driver);
  driver.stick.watch(([forward, left]) => {
    const reach = 38 / Math.max(1, Math.hypot(forward, left));
    knob.style.transform = `translate(${-left * reach}px, ${-forward * reach}px)`;
    pad.classList.toggle("held", forward !== 0 || left !== 0);
  });

  const share = h("input", {
    type: "range",
    min: 10,
    max: 100,
    step: 5,
    value: driver.share.value * 100,
    "aria-label": "Speed limit in percent",
  });
  const percent = h("output", { class: "value" });
  const limit = (): void => {
    driver.share.set(share.valueAsNumber / 100);
    percent.textContent = `${share.value} %`;
    share.style.setProperty("--at", String((share.valueAsNumber - 10) / 90));
  };
  share.addEventListener("input", limit);
  limit();

  const forward = meter("Forward", "m/s", 2);
  const turn = meter("Turn", "rad/s", 2);
  const believed = place("Odometry", "Pose from wheel odometry, relative to the start");
  const truth = place("In the world", "True pose of the robot in the simulated world");
  const driverNote = h("p", { class: "who", role: "status" });
  const controls = h(
    "div",
    { class: "drive" },
    h(
      "div",
      { class: "pad-row" },
      pad,
      h(
        "div",
        { class: "pad-side" },
        h("label", { class: "limit" }, "Limit", percent, share),
        h(
          "button",
          { type: "button", class: "stop", title: "Stop (Space)", onclick: () => stop(app, driver) },
          "Stop",
        ),
        driverNote,
      ),
    ),
    forward.element,
    turn.element,
    believed.element,
    truth.element,
  );
  app.about.watch((about) => {
    controls.hidden = about?.cannot_drive !== "";
    why.hidden = !controls.hidden;
    why.textContent = about?.cannot_drive ? `This robot cannot be driven: ${about.cannot_drive}` : "";
  });
  const showDriver = (): void => {
    const driver = app.state.value?.driver ?? 0;
    const other = driver !== 0 && driver !== app.about.value?.client;
    const program = app.program.value?.phase === "running" ? app.program.value.name : "";
    write(driverNote, program ? `${program} drives` : other ? "Driven from another tab" : "");
  };
  app.state.watchThrottled((state) => {
    const about = app.about.value;
    if (state === null || about === null) return;
    forward.set(state.twist[0] ?? 0, state.command[0] ?? 0, about.linear_limit);
    turn.set(state.twist[1] ?? 0, state.command[1] ?? 0, about.angular_limit);
    const [x = 0, y = 0, yaw = 0] = state.odometry;
    const [trueX, trueY, trueYaw] = standing(app, state);
    believed.set(x, y, yaw);
    truth.set(trueX, trueY, trueYaw);
    const isApart = Math.hypot(trueX - x, trueY - y) > FAR || Math.abs(wrap(trueYaw - yaw)) > TURNED;
    truth.element.classList.toggle("apart", isApart);
    write(truth.title, isApart ? "In the world: differs from odometry" : "In the world");
    showDriver();
  });
  app.program.watch(showDriver); // its end may be followed by no state
  return panel("drive", "Drive", [], controls, why);
}

/** Stops the robot, whoever is driving it. */
export function stop(app: App, driver: Driver): void {
  driver.stop();
  if (app.about.value?.mode === "sim") app.send({ type: "stop" });
}

function usePad(pad: HTMLElement, driver: Driver): void {
  const follow = (event: PointerEvent): void => {
    const box = pad.getBoundingClientRect();
    const reach = box.width * 0.36;
    let left = -(event.clientX - box.left - box.width / 2) / reach;
    let forward = -(event.clientY - box.top - box.height / 2) / reach;
    const length = Math.max(1, Math.hypot(left, forward));
    left /= length;
    forward /= length;
    driver.setPad(steady(forward), steady(left));
  };
  pad.addEventListener("pointerdown", (event) => {
    pad.setPointerCapture(event.pointerId);
    event.preventDefault();
    driver.setPad(0, 0); // the end of the last press may have been lost, for example while the computer slept
    follow(event);
  });
  pad.addEventListener("pointermove", (event) => pad.hasPointerCapture(event.pointerId) && follow(event));
  for (const name of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
    pad.addEventListener(name, () => driver.setPad(0, 0));
  }
}

/** Applies a dead zone, so that driving straight ahead is easy. */
function steady(value: number): number {
  return Math.abs(value) < 0.14 ? 0 : value;
}

interface Meter {
  element: HTMLElement;
  set: (value: number, commanded: number, limit: number) => void;
}

function meter(label: string, unit: string, digits: number): Meter {
  const value = readout(`${label} in ${unit}`, { class: "number" });
  const bar = h("span", { class: "bar" });
  const commanded = h("span", { class: "asked" });
  const element = h(
    "div",
    { class: "meter" },
    h("span", { class: "label" }, label),
    value,
    h("span", { class: "unit" }, unit),
    h("span", { class: "track" }, bar, commanded),
  );
  return {
    element,
    set: (now, command, limit) => {
      write(value, fixed(now, digits));
      const part = Math.max(-1, Math.min(1, now / (limit || 1)));
      bar.style.left = `${(50 + Math.min(0, part) * 50).toFixed(1)}%`;
      bar.style.width = `${(Math.abs(part) * 50).toFixed(1)}%`;
      commanded.style.left = `${(50 + Math.max(-1, Math.min(1, command / (limit || 1))) * 50).toFixed(1)}%`;
    },
  };
}

/** Pose of the robot's root in the world: x and y in m, yaw in rad. */
function standing(app: App, state: State): [number, number, number] {
  const scene = app.scene.value;
  const root = scene?.links.findIndex((link) => link.name === scene.root) ?? -1;
  const [x = 0, y = 0, , ...turn] = root < 0 ? [] : state.poses.slice(root * 7, root * 7 + 7);
  return [x, y, yawOf(turn)];
}

/** A title with x, y and yaw. */
function place(
  name: string,
  what: string,
): { element: HTMLElement; title: HTMLElement; set: (x: number, y: number, yaw: number) => void } {
  const [x, y, yaw] = [reading(name, "x", "m", 3), reading(name, "y", "m", 3), reading(name, "yaw", "°", 1)];
  const title = h("span", { class: "title" }, name);
  const element = h(
    "div",
    { class: "pose", role: "group", "aria-label": name, title: what },
    title,
    x.element,
    y.element,
    yaw.element,
  );
  return {
    element,
    title,
    set: (atX, atY, heading) => {
      x.set(atX);
      y.set(atY);
      yaw.set((wrap(heading) * 180) / Math.PI);
    },
  };
}

function reading(
  of: string,
  label: string,
  unit: string,
  digits: number,
): { element: HTMLElement; set: (value: number) => void } {
  const value = readout(`${of}: ${label} in ${unit}`, { class: "number", "data-reading": label });
  return {
    element: h(
      "span",
      { class: "reading" },
      h("span", { class: "label" }, label),
      value,
      h("span", { class: "unit" }, unit),
    ),
    set: (now) => {
      write(value, fixed(now, digits));
    },
  };
}

/** A number of constant width, with a minus sign as wide as a digit. */
function fixed(value: number, digits: number): string {
  return rounded(value, digits).replace("-", "\u2212");
}
