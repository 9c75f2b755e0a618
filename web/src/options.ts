import { Signal } from "./signal";

/** What is shown, as this browser remembers it. */
export interface Options {
  visual: boolean;
  collision: boolean;
  inertia: boolean;
  frames: boolean;
  names: boolean;
  grid: boolean;
  trail: boolean;
  follow: boolean;
  scan: boolean;
  /** Seen from the robot. */
  ride: boolean;
  /** Without perspective. */
  flat: boolean;
}

export type Theme = "dark" | "light";

const KEY = "kbot.options";
const THEME_KEY = "kbot.theme";

const DEFAULTS: Options = {
  visual: true,
  collision: false,
  inertia: false,
  frames: false,
  names: false,
  grid: true,
  trail: true,
  follow: true,
  scan: true,
  ride: false,
  flat: false,
};

export function rememberedOptions(): Signal<Options> {
  const signal = new Signal<Options>({ ...DEFAULTS, ...(read(KEY) as Partial<Options> | null) });
  signal.watch((options) => write(KEY, options));
  return signal;
}

/** The theme chosen here before, else the system's. */
export function rememberedTheme(): Signal<Theme> {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const chosen = read(THEME_KEY);
  const signal = new Signal<Theme>(chosen === "dark" || chosen === "light" ? chosen : dark.matches ? "dark" : "light");
  if (chosen === null) dark.addEventListener("change", () => read(THEME_KEY) ?? signal.set(dark.matches ? "dark" : "light"));
  signal.watch((theme) => {
    document.documentElement.dataset["theme"] = theme;
  });
  return signal;
}

export function chooseTheme(signal: Signal<Theme>, theme: Theme): void {
  write(THEME_KEY, theme);
  signal.set(theme);
}

function read(key: string): unknown {
  try {
    return JSON.parse(localStorage.getItem(key) ?? "null");
  } catch {
    return null; // storage is off, or holds something else
  }
}

function write(key: string, value: unknown): void {
  try {
    localStorage.setItem(key, JSON.stringify(value));
  } catch {
    // storage is off: nothing is remembered
  }
}
