import { Signal } from "./signal";
import type { Side } from "./view/sides";

/** View options, stored in the browser. */
export interface Options {
  follow: boolean;
  /** The camera rides on the robot. */
  ride: boolean;
  /** Orthographic projection. */
  flat: boolean;
  /** The side that the view is locked to, with orthographic projection. Empty for a free view. */
  side: Side | "";
  /** Joint positions in rad and m instead of degrees and mm. */
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

export function storedOptions(): Signal<Options> {
  const signal = new Signal<Options>({ ...DEFAULTS, ...(loadStored(KEY) as Partial<Options> | null) });
  signal.watch((options) => store(KEY, options));
  return signal;
}

/** Changes one option, and unlocks the side if it is incompatible with the change. */
export function withOption<K extends keyof Options>(options: Options, name: K, value: Options[K]): Options {
  const leavesSide = (name === "flat" && value === false) || (name === "ride" && value === true);
  return { ...options, ...(leavesSide ? { side: "" } : {}), [name]: value };
}

/** The stored theme. Without one, the theme of the embedding page (such as a notebook) or of the system. */
export function storedTheme(): Signal<Theme> {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const chosen = loadStored(THEME_KEY);
  const around = (): Theme => {
    const schemes = frameElement === null ? "light dark" : getComputedStyle(frameElement).colorScheme;
    return schemes.includes("dark") && (dark.matches || !schemes.includes("light")) ? "dark" : "light";
  };
  const signal = new Signal<Theme>(chosen === "dark" || chosen === "light" ? chosen : around());
  const follow = (): void => {
    if (loadStored(THEME_KEY) === null && signal.value !== around()) signal.set(around());
  };
  dark.addEventListener("change", follow);
  if (frameElement !== null) whenRestyled(frameElement.ownerDocument, follow);
  signal.watch((theme) => {
    document.documentElement.dataset["theme"] = theme;
  });
  return signal;
}

/** Calls back when a document's style may have changed: by an attribute of its root or body, or a style sheet. */
function whenRestyled(document: Document, changed: () => void): void {
  const observer = new MutationObserver(changed);
  for (const element of [document.documentElement, document.body])
    observer.observe(element, { attributes: true });
  observer.observe(document.head, { childList: true, subtree: true });
  document.addEventListener(
    "load",
    (event) => (event.target as Element).tagName === "LINK" && changed(),
    true,
  );
}

export function chooseTheme(signal: Signal<Theme>, theme: Theme): void {
  store(THEME_KEY, theme);
  signal.set(theme);
}

/** A value stored in the browser, null if there is none. */
export function loadStored(key: string): unknown {
  try {
    return JSON.parse(localStorage.getItem(key) ?? "null");
  } catch {
    return null; // storage is disabled or holds invalid JSON
  }
}

export function store(key: string, value: unknown): void {
  try {
    localStorage.setItem(key, JSON.stringify(value));
  } catch {
    // storage is disabled: nothing is stored
  }
}
