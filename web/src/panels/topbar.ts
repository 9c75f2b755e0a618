import type { App } from "../app";
import { baseName, h } from "../dom";
import { letGo } from "../focus";
import { icon } from "../icons";
import { chooseTheme } from "../options";
import { worldMenu } from "./world-menu";

/** The top bar: file, mode or world, connection and theme. */
export function topbar(app: App, help: () => void): HTMLElement {
  const file = h("span", { class: "file" });
  const mode = h("span", { class: "mode" }, "view");
  const world = h("select", { class: "mode", "aria-label": "World", title: "Restart in another world" });
  world.addEventListener("change", () => {
    app.send({ type: "set_world", world: world.value, seed: app.about.value?.seed ?? 0 });
    letGo(world);
  });
  const inWorld = h("span", { class: "in-world", "aria-hidden": "true" }, "in world");
  const editLabel = h("span", {});
  const edit = h(
    "button",
    {
      class: "edit-source",
      type: "button",
      onclick: () => (app.spot.value === null ? app.edit() : app.spot.set(null)),
    },
    icon("code"),
    editLabel,
  );
  app.spot.watch((spot) => edit.setAttribute("aria-pressed", String(spot !== null)));
  const link = h("span", { class: "status", role: "status" });
  const theme = h("button", {
    class: "icon-button",
    type: "button",
    onclick: () => chooseTheme(app.theme, app.theme.value === "dark" ? "light" : "dark"),
  });
  app.theme.watch((now) => {
    const other = now === "dark" ? "light" : "dark";
    theme.replaceChildren(icon(now === "dark" ? "sun" : "moon"));
    theme.title = `Use the ${other} theme (T)`;
    theme.setAttribute("aria-label", theme.title);
  });
  // a recording is not live, although its server is connected
  function showLink(): void {
    const now = app.connection.link.value;
    const live = app.about.value?.mode === "play" ? "connected" : "live";
    link.dataset["link"] = now;
    const lost = app.connection.hasEnded ? "ended" : "connection lost";
    link.textContent = { connecting: "connecting", live, lost, full: "too many tabs" }[now];
  }
  app.about.watch((about) => {
    if (about === null) return;
    const shown = about.played || about.file;
    file.textContent = baseName(shown);
    file.title = shown;
    editLabel.textContent = app.canWrite ? "Edit" : "Source";
    edit.ariaLabel = editLabel.textContent; // a narrow window has no room for the text
    edit.title = app.canWrite ? `Edit ${baseName(about.file)} here` : `Show ${baseName(about.file)}`;
    mode.textContent = about.mode === "play" ? "recording" : "view";
    mode.hidden = about.mode === "sim";
    world.hidden = inWorld.hidden = about.mode !== "sim";
    const builtIn = about.worlds.map((choice) => choice.name);
    const names = builtIn.includes(about.world) ? builtIn : [about.world, ...builtIn];
    world.replaceChildren(
      ...names.map((name) => h("option", { value: name }, baseName(name).replaceAll("_", " "))),
    );
    world.value = about.world;
    document.title = `${baseName(shown)} · KBot`;
    showLink();
  });
  app.connection.link.watch(showLink);
  return h(
    "header",
    { class: "topbar" },
    h(
      "h1",
      { class: "brand" },
      h("img", { src: new URL("../icon.svg", import.meta.url).href, alt: "", width: 22, height: 22 }),
      "KBot",
    ),
    h("span", { class: "crumbs" }, file, edit, mode, inWorld, world, worldMenu(app)),
    h("span", { class: "spacer" }),
    link,
    h(
      "button",
      { class: "icon-button", type: "button", title: "Keys (?)", "aria-label": "Keys", onclick: help },
      icon("help"),
    ),
    theme,
  );
}
