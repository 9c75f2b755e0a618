import type { App } from "../app";
import { h } from "../dom";
import { icon } from "../icons";

const SHOWN_FOR = 5000;

/** What lies over the picture: a broken description, a lost connection, a refused request. */
export function notices(app: App, picture: HTMLElement): HTMLElement {
  const broken = h("div", { class: "notice error", role: "alert", hidden: true });
  const lost = h("div", { class: "notice warning", role: "alert", hidden: true }, icon("warning"), "The server does not answer. What you see is from before; connecting again…");
  const refused = h("div", { class: "notice info", role: "status", hidden: true });
  app.findings.watch((now) => {
    const stale = now?.stale === true;
    picture.classList.toggle("stale", stale);
    broken.hidden = !stale;
    if (!stale || now === null) return;
    const errors = now.findings.filter((finding) => finding.severity === "error");
    const first = errors[0];
    broken.replaceChildren(
      icon("error"),
      h("span", {}, `The file has ${errors.length === 1 ? "an error" : `${errors.length} errors`}. You see the last good robot. `),
      first ? h("button", { type: "button", onclick: () => app.selectFinding(first) }, "Show it") : "",
    );
  });
  const full = h("div", { class: "notice warning", role: "alert", hidden: true }, icon("warning"), "The server has as many tabs as it serves. Close some; this one tries again by itself.");
  app.connection.link.watch((link) => {
    lost.hidden = link !== "lost";
    full.hidden = link !== "full";
    picture.classList.toggle("lost", link === "lost" || link === "full");
  });
  let timer: ReturnType<typeof setTimeout> | undefined;
  const say = (text: string): void => {
    refused.replaceChildren(icon("info"), text);
    refused.hidden = false;
    clearTimeout(timer);
    timer = setTimeout(() => (refused.hidden = true), SHOWN_FOR);
  };
  app.refused.watch((now) => now !== null && say(now.reason));
  app.told.watch((now) => now !== null && say(now.text));
  return h("div", { class: "notices" }, broken, lost, full, refused);
}
