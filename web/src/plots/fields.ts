import type { Scene, State } from "../protocol";

/** A number that can be plotted. */
export interface Field {
  name: string;
  group: string;
  unit: string;
  /** How the server calls it: `state twist.0`, or a topic and the way through its messages. */
  key: string;
  value: (state: State) => number;
}

/** All that can be plotted of a scene; what a recording does not tell is left out. */
export function fields(scene: Scene | null, played: boolean): Field[] {
  const of = (
    name: string,
    group: string,
    unit: string,
    key: string,
    value: (state: State) => number,
  ): Field => ({ name, group, unit, key: `state ${key}`, value });
  const live = [
    of("forward speed asked", "Speed", "m/s", "command.0", (state) => state.command[0] ?? 0),
    of("turning speed asked", "Speed", "rad/s", "command.1", (state) => state.command[1] ?? 0),
    of("real-time factor", "Simulation", "", "rate", (state) => state.rate),
  ];
  return [
    of("forward speed", "Speed", "m/s", "twist.0", (state) => state.twist[0] ?? 0),
    of("turning speed", "Speed", "rad/s", "twist.1", (state) => state.twist[1] ?? 0),
    of("x", "Odometry", "m", "odometry.0", (state) => state.odometry[0] ?? 0),
    of("y", "Odometry", "m", "odometry.1", (state) => state.odometry[1] ?? 0),
    of("yaw", "Odometry", "rad", "odometry.2", (state) => state.odometry[2] ?? 0),
    ...(played ? [] : live),
    ...(scene?.joints ?? []).map((joint, index) =>
      of(
        joint.name,
        "Joints",
        joint.kind === "prismatic" ? "m" : "rad",
        `positions.${joint.name}`,
        (state) => state.positions[index] ?? 0,
      ),
    ),
  ];
}

/** `forward speed [m/s]`. */
export function labelled({ name, unit }: Field): string {
  return name + (unit && ` [${unit}]`);
}

const KEY = "kbot.plots";

/** What was plotted in this browser before. */
export function rememberedFields(): string[] {
  try {
    const value: unknown = JSON.parse(localStorage.getItem(KEY) ?? "null");
    if (Array.isArray(value)) return value.filter((name) => typeof name === "string");
  } catch {
    // storage is off, or holds something else
  }
  return ["forward speed", "forward speed asked", "turning speed"];
}

export function rememberFields(names: string[]): void {
  try {
    localStorage.setItem(KEY, JSON.stringify(names));
  } catch {
    // storage is off: nothing is remembered
  }
}
