import type { App } from "./app";
import type { Driver } from "./drive-keys";
import { isTyping } from "./dom";
import { chooseTheme } from "./options";
import { stop } from "./panels/drive";
import { TOGGLE_KEYS } from "./panels/toolbar";
import type { View } from "./view/view";

/** The keys that are pressed once; held ones drive. */
export function useKeys(app: App, view: View, driver: Driver, help: () => void): void {
  const actions: Record<string, () => unknown> = {
    " ": () => stop(app, driver),
    p: () => app.send({ type: "pause", paused: !app.state.value?.paused }),
    ".": () => app.send({ type: "advance", seconds: 0.1 }),
    r: () => app.send({ type: "reset" }),
    f: () => (app.selected.value === "" ? view.fit() : view.focus(app.selected.value)),
    l: () => app.about.value?.mode === "sim" && app.plots.set(!app.plots.value),
    t: () => chooseTheme(app.theme, app.theme.value === "dark" ? "light" : "dark"),
    "?": help,
    Escape: () => {
      app.spot.set(null);
      app.selected.set("");
    },
  };
  addEventListener("keydown", (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key === "z" && !isTyping(event.target) && app.parameters.value?.undo) {
      event.preventDefault();
      app.send({ type: "undo" });
    }
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat || isTyping(event.target)) return;
    if (document.querySelector("dialog[open]") !== null) return;
    const onButton = event.target instanceof HTMLButtonElement;
    const option = TOGGLE_KEYS.get(event.key);
    if (option !== undefined) app.setOption(option, !app.options.value[option]);
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (action === undefined || (onButton && event.key === " ")) return;
    event.preventDefault();
    action();
  });
}
