import type { App } from "../app";
import { h } from "../dom";
import { goalWords, onGoal } from "../tools/goal";

const MOST = 300;

type Level = "error" | "warning" | "info";

/** What was said since the page was opened, with the simulated time: refusals, notices, findings, goals. */
export function log(app: App): HTMLElement {
  const list = h("ol", {});
  const log = h("div", { class: "log", role: "log", "aria-label": "Log", tabindex: 0 }, list);
  const add = (level: Level, text: string): void => {
    const atEnd = log.scrollTop + log.clientHeight >= log.scrollHeight - 8;
    const time = app.about.value?.mode === "sim" ? `${(app.state.value?.time ?? 0).toFixed(2)} s` : new Date().toLocaleTimeString();
    list.append(h("li", { "data-level": level }, h("time", {}, time), h("span", {}, text)));
    while (list.childElementCount > MOST) list.firstElementChild?.remove();
    if (atEnd) log.scrollTop = log.scrollHeight;
  };
  app.refused.watch((now) => now && add("warning", now.reason));
  app.told.watch((now) => now && add("info", now.text));
  app.connection.link.watch((link) => {
    if (link === "live") add("info", "Connected.");
    if (link === "lost") add("error", "The connection is lost.");
  });
  let world = "";
  app.about.watch((about) => {
    if (about === null || about.mode !== "sim" || about.world === world) return;
    world = about.world;
    add("info", `World: ${world}.`);
  });
  let serial: number | null = null;
  app.findings.watch((now) => {
    if (now === null || now.serial === serial) return;
    serial = now.serial;
    for (const { severity, code, message, place } of now.findings) {
      add(severity, `${place === null ? "" : `${place.file.split(/[\\/]/).pop()}:${place.line}: `}${message} [${code}]`);
    }
    if (now.findings.length === 0) add("info", "Read: nothing found.");
  });
  onGoal(app, (state, reason) => add(state === "stuck" || state === "refused" ? "warning" : "info", goalWords(state, reason)));
  return log;
}
