import type { App } from "./app";
import type { Scene, State } from "./protocol";

const SECONDS = 60;
const MOST = SECONDS * 60;

/** A field of the state that can be plotted. */
export interface Field {
  name: string;
  group: string;
  unit: string;
  value: (state: State) => number;
}

/** The last minute of simulated time, for the plots. */
export class History {
  states: State[] = [];

  constructor(app: App) {
    app.state.watch((state) => state && !app.travel.isPast && this.add(state));
    app.scene.watch(() => this.forgetOthers(app));
  }

  private add(state: State): void {
    const last = this.states.at(-1);
    if (last !== undefined && (state.time < last.time || state.resets !== last.resets)) this.states = [];
    if (last !== undefined && state.time === last.time) return;
    this.states.push(state);
    if (this.states.length > MOST * 1.2) this.states = this.states.slice(-MOST);
  }

  /** Joints may be others after a change: what was before has no meaning for them. */
  private forgetOthers(app: App): void {
    const count = app.scene.value?.joints.length;
    if (this.states.some((state) => state.positions.length !== count)) this.states = [];
  }
}

/** All that can be plotted of a scene. */
export function fields(scene: Scene | null): Field[] {
  const of = (name: string, group: string, unit: string, value: (state: State) => number): Field => ({ name, group, unit, value });
  return [
    of("forward speed", "Speed", "m/s", (state) => state.twist[0] ?? 0),
    of("forward speed asked", "Speed", "m/s", (state) => state.command[0] ?? 0),
    of("turning speed", "Speed", "rad/s", (state) => state.twist[1] ?? 0),
    of("turning speed asked", "Speed", "rad/s", (state) => state.command[1] ?? 0),
    of("x", "Odometry", "m", (state) => state.odometry[0] ?? 0),
    of("y", "Odometry", "m", (state) => state.odometry[1] ?? 0),
    of("yaw", "Odometry", "rad", (state) => state.odometry[2] ?? 0),
    of("real-time factor", "Simulation", "", (state) => state.rate),
    ...(scene?.joints ?? []).map((joint, index) =>
      of(joint.name, "Joints", joint.kind === "prismatic" ? "m" : "rad", (state) => state.positions[index] ?? 0),
    ),
  ];
}
