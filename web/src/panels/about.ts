import { h } from "../dom";

/** The licence of KBot, and those of the packages in the page. A page without a server has their text. */
export function about(licences?: string): HTMLElement {
  return h(
    "section",
    { class: "about" },
    h("h2", { tabindex: -1, autofocus: licences !== undefined }, "About"),
    h(
      "p",
      {},
      "KBot is licensed under the Apache License 2.0. This page contains third-party packages and fonts.",
    ),
    licences === undefined
      ? h("a", { href: "./third-party-licences.txt", target: "_blank" }, "Show their licences")
      : h("details", {}, h("summary", {}, "Show their licences"), h("pre", { tabindex: 0 }, licences)),
  );
}

/** The dialog of a page without a server. */
export function aboutDialog(licences: string): HTMLDialogElement {
  return h(
    "dialog",
    { class: "help", "aria-label": "About" },
    about(licences),
    h("form", { method: "dialog" }, h("button", { class: "primary" }, "Close")),
  );
}
