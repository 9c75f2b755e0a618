import { Signal } from "./signal";
import type { Side } from "./view/sides";

/** How one looks, as this browser remembers it. */
export interface Options {
  follow: boolean;
  /** Seen from the robot. */
  ride: boolean;
  /** Without perspective. */
  flat: boolean;
  /** From above or a side, flat and staying so; empty from anywhere. */
  side: Side | "";
  /** Joints in rad and m, not degrees and mm. */
  radians: boolean;
}

export type Theme = "dark" | "light";

const KEY = "kbot.options";
const THEME_KEY = "kbot.theme";

const DEFAULTS: Options = {
  follow: true,
  ride: false,
  flat: false,
  side: "",
  radians: false,
};

export function rememberedOptions(): Signal<Options> {
  const signal = new Signal<Options>({ ...DEFAULTS, ...(recalled(KEY) as Partial<Options> | null) });
  signal.watch((options) => remember(KEY, options));
  return signal;
}

/** The options with one of them changed, and what does not go with it given up. */
export function withOption<K extends keyof Options>(options: Options, name: K, value: Options[K]): Options {
  const leavesSide = (name === "flat" && value === false) || (name === "ride" && value === true);
  return { ...options, ...(leavesSide ? { side: "" } : {}), [name]: value };
}

/** The theme chosen here before, else that of what is around, as a notebook, else the system's. */
export function rememberedTheme(): Signal<Theme> {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const chosen = recalled(THEME_KEY);
  const around = (): Theme => {
    const schemes = frameElement === null ? "light dark" : getComputedStyle(frameElement).colorScheme;
    return schemes.includes("dark") && (dark.matches || !schemes.includes("light")) ? "dark" : "light";
  };
  const signal = new Signal<Theme>(chosen === "dark" || chosen === "light" ? chosen : around());
  const follow = (): void => {
    if (recalled(THEME_KEY) === null && signal.value !== around()) signal.set(around());
  };
  dark.addEventListener("change", follow);
  if (frameElement !== null) whenRestyled(frameElement.ownerDocument, follow);
  signal.watch((theme) => {
    document.documentElement.dataset["theme"] = theme;
  });
  return signal;
}

/** Tells when a document may look otherwise: its root or body is marked, or a style sheet comes or goes. */
function whenRestyled(document: Document, told: () => void): void {
  const observer = new MutationObserver(told);
  for (const element of [document.documentElement, document.body])
    observer.observe(element, { attributes: true });
  observer.observe(document.head, { childList: true, subtree: true });
  document.addEventListener("load", (event) => (event.target as Element).tagName === "LINK" && told(), true);
}

export function chooseTheme(signal: Signal<Theme>, theme: Theme): void {
  remember(THEME_KEY, theme);
  signal.set(theme);
}

/** What this browser was told to remember, null where it was not. */
export function recalled(key: string): unknown {
  try {
    return JSON.parse(localStorage.getItem(key) ?? "null");
  } catch {
    return null; // storage is off, or holds something else
  }
}

export function remember(key: string, value: unknown): void {
  try {
    localStorage.setItem(key, JSON.stringify(value));
  } catch {
    // storage is off: nothing is remembered
  }
}
