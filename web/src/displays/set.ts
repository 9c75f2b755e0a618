import { loadStored, store } from "../options";
import { Signal } from "../signal";
import { GLOBALS, KINDS, type DisplayKind, type Property } from "./kinds";

export type Value = boolean | number | string;
export type Values = Readonly<Record<string, Value>>;

/** The status of a display, and the reason for it. */
export interface Status {
  level: "ok" | "warn" | "error" | "off";
  reason: string;
}

/** The settings of a display, as plain data. Missing properties have their initial value. */
export interface DisplayConfig {
  readonly id: number;
  readonly kind: string;
  readonly name: string;
  readonly enabled: boolean;
  readonly properties: Values;
  /** Its index in the rviz file that it was loaded from, -1 for none. */
  readonly source: number;
}

export type Saved = Omit<DisplayConfig, "id">;

/** A display as stored by a file or an older page, which may lack `source`. */
type StoredDisplay = Omit<Saved, "source"> & Partial<Pick<Saved, "source">>;

/** A viewpoint in the axes of the fixed frame, relative to its origin or to that of `frame`. `flat` is orthographic. */
export interface ViewSettings {
  readonly eye: readonly number[];
  readonly target: readonly number[];
  readonly flat: boolean;
  readonly follow: boolean;
  readonly frame?: string;
}

/** All settings of the displays, as stored. */
export interface Setup {
  readonly globals: Values;
  readonly displays: readonly StoredDisplay[];
}

const KEY = "kbot.displays";

const START: readonly Saved[] = ["Grid", "RobotModel", "TF", "Trail", "World", "LaserScan"].map((kind) => ({
  kind,
  name: kind,
  enabled: true,
  properties: kind === "LaserScan" ? { beams: true } : {},
  source: -1,
}));

/** Whether a display is one of the initial displays, and the user has not changed it. */
export function isInitial({ kind, name, enabled, properties, source }: DisplayConfig): boolean {
  const start = START.find((candidate) => candidate.kind === kind);
  return JSON.stringify(start) === JSON.stringify({ kind, name, enabled, properties, source });
}

/** The display kind with a name. */
export function kindOf(name: string): DisplayKind {
  const kind = KINDS.find((candidate) => candidate.name === name);
  if (kind === undefined) throw new Error(`no display of kind ${name}`);
  return kind;
}

/** The value of a display's property. */
export function valueOf(config: DisplayConfig, property: Property): Value {
  return config.properties[property.name] ?? property.initial;
}

/** The values of all properties of a display. */
export function valuesOf(config: DisplayConfig): Values {
  return {
    ...Object.fromEntries(
      kindOf(config.kind).properties.map((property) => [property.name, property.initial]),
    ),
    ...config.properties,
  };
}

/** The ordered list of displays and the global options, stored in the browser. */
export class DisplaySet {
  readonly all: Signal<readonly DisplayConfig[]>;
  readonly globals: Signal<Values>;
  private count = 0;
  private isStored = true;

  constructor() {
    const stored = loadStored(KEY);
    const { globals, displays } = isValidSetup(stored) ? stored : { globals: {}, displays: START };
    this.all = new Signal<readonly DisplayConfig[]>(this.numbered(displays));
    this.globals = new Signal(globals);
    for (const signal of [this.all, this.globals])
      (signal as Signal<unknown>).watch(() => this.isStored && store(KEY, this.setup));
  }

  get setup(): Setup {
    return { globals: this.globals.value, displays: this.all.value.map(plain) };
  }

  /** The value of a global option. */
  global(name: string): Value {
    return this.globals.value[name] ?? GLOBALS.find((property) => property.name === name)!.initial;
  }

  setGlobal(name: string, value: Value): void {
    this.globals.set({ ...this.globals.value, [name]: value });
  }

  /** Adds a display. Returns null if the kind allows only one and it exists. */
  add(kind: string): DisplayConfig | null {
    const { single } = kindOf(kind);
    if (single && this.all.value.some((display) => display.kind === kind)) return null;
    const [added] = this.numbered([
      {
        kind,
        name: this.freeName(kind),
        enabled: true,
        properties: this.initialProperties(kind),
        source: -1,
      },
    ]);
    this.all.set([...this.all.value, added!]);
    return added!;
  }

  remove(id: number): void {
    this.all.set(this.all.value.filter((display) => display.id !== id));
  }

  rename(id: number, name: string): void {
    const [before, after] = [this.all.value.find((display) => display.id === id)?.name, name.trim()];
    if (before === undefined || after === "" || after === before) return;
    this.all.set(
      this.all.value.map((display) => ({
        ...display,
        properties: renamed(display, before, after),
        name: display.id === id ? after : display.name,
      })),
    );
  }

  /** Moves a display up (-1) or down (1) in the list. */
  move(id: number, by: -1 | 1): void {
    const all = [...this.all.value];
    const from = all.findIndex((display) => display.id === id);
    const to = from + by;
    if (from < 0 || to < 0 || to >= all.length) return;
    [all[from], all[to]] = [all[to]!, all[from]!];
    this.all.set(all);
  }

  enable(id: number, enabled: boolean): void {
    this.change(id, { enabled });
  }

  set(id: number, property: string, value: Value): void {
    const config = this.all.value.find((display) => display.id === id);
    if (config !== undefined) this.change(id, { properties: { ...config.properties, [property]: value } });
  }

  /** Replaces all settings. `remembers` is whether the browser stores them from now on. */
  replace({ globals, displays }: Setup, isStored = this.isStored): void {
    this.isStored = isStored;
    this.globals.set(globals);
    this.all.set(this.numbered(displays));
  }

  /** Resets all settings to their defaults. */
  reset(): void {
    this.replace({ globals: {}, displays: START });
  }

  /** Whether any display of a kind is enabled and, with a property's name, has it on. */
  isOn(kind: string, property: string | null): boolean {
    return this.all.value.some(
      (display) =>
        display.kind === kind &&
        display.enabled &&
        (property === null || valuesOf(display)[property] === true),
    );
  }

  /** Turns all displays of a kind, or one of their properties, on or off. Adds a display if there is none. */
  turn(kind: string, property: string | null, on: boolean): void {
    if (on && !this.all.value.some((display) => display.kind === kind)) this.add(kind);
    this.all.set(
      this.all.value.map((display) => {
        if (display.kind !== kind) return display;
        if (property === null) return { ...display, enabled: on };
        return {
          ...display,
          enabled: display.enabled || on,
          properties: { ...display.properties, [property]: on },
        };
      }),
    );
  }

  /** Initial properties of an added display. The floor draws the lines of one grid; another grid gets cells as in rviz. */
  private initialProperties(kind: string): Values {
    const isRuled = this.all.value.some(
      (display) => display.kind === "Grid" && valuesOf(display)["count"] === 0,
    );
    return kind === "Grid" && isRuled ? { count: 10, colour: "#a0a0a4" } : {};
  }

  private change(id: number, to: Partial<DisplayConfig>): void {
    this.all.set(this.all.value.map((display) => (display.id === id ? { ...display, ...to } : display)));
  }

  private freeName(kind: string): string {
    const taken = new Set(this.all.value.map((display) => display.name));
    let name = kind;
    for (let i = 2; taken.has(name); i += 1) name = `${kind} ${i}`;
    return name;
  }

  private numbered(saved: readonly StoredDisplay[]): DisplayConfig[] {
    return saved.map((display) => ({ ...plain(display), id: (this.count += 1) }));
  }
}

function plain({ kind, name, enabled, properties, source = -1 }: StoredDisplay): Saved {
  return { kind, name, enabled, properties, source };
}

/** The properties of a display after another display was renamed. */
function renamed({ kind, properties }: DisplayConfig, before: string, after: string): Values {
  const names = new Map(
    kindOf(kind).per_display.map(({ name }) => [`${before}/${name}`, `${after}/${name}`]),
  );
  return Object.fromEntries(
    Object.entries(properties).map(([name, value]) => [names.get(name) ?? name, value]),
  );
}

/** Whether a stored value is valid: an older page may have stored another format. */
function isValidSetup(stored: unknown): stored is Setup {
  const kinds = new Set(KINDS.map((kind) => kind.name));
  const { globals, displays } = (stored ?? {}) as { globals?: unknown; displays?: unknown };
  return (
    typeof globals === "object" &&
    Array.isArray(displays) &&
    displays.every(
      (display: Partial<Saved> | null) =>
        kinds.has(display?.kind ?? "") &&
        typeof display?.name === "string" &&
        typeof display.properties === "object",
    )
  );
}
