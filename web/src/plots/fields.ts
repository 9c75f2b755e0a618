import type { Scene, State } from "../protocol";

/** A number that can be plotted. */
export interface Field {
  name: string;
  /** What the plot shows instead of the name. */
  label?: string;
  group: string;
  unit: string;
  /** Its key on the server: `state twist.0`, or a topic and a path in its messages. */
  key: string;
  value: (state: State) => number;
}

/** All fields that can be plotted. A recording lacks some of them. */
export function fields(scene: Scene | null, played: boolean): Field[] {
  const of = (
    name: string,
    group: string,
    unit: string,
    key: string,
    value: (state: State) => number,
  ): Field => ({ name, group, unit, key: `state ${key}`, value });
  const live = [
    of("commanded forward speed", "Speed", "m/s", "command.0", (state) => state.command[0] ?? 0),
    of("commanded turning speed", "Speed", "rad/s", "command.1", (state) => state.command[1] ?? 0),
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

/** The name with its unit, such as `forward speed [m/s]`. */
export function labelled({ name, label, unit }: Field): string {
  return (label ?? name) + (unit && ` [${unit}]`);
}

const KEY = "kbot.plots";

/** The fields that this browser plotted last. */
export function storedFields(): string[] {
  try {
    const value: unknown = JSON.parse(localStorage.getItem(KEY) ?? "null");
    if (Array.isArray(value)) return value.filter((name) => typeof name === "string");
  } catch {
    // storage is disabled or holds something else
  }
  return ["forward speed", "commanded forward speed", "turning speed"];
}

/** Whether the user or a program chose fields in this browser. */
export function hasStoredFields(): boolean {
  try {
    return localStorage.getItem(KEY) !== null;
  } catch {
    return false;
  }
}

export function storeFields(names: string[]): void {
  try {
    localStorage.setItem(KEY, JSON.stringify(names));
  } catch {
    // storage is disabled: nothing is stored
  }
}
