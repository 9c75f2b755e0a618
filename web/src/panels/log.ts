import type { App } from "../app";
import { baseName, h } from "../dom";
import { icon } from "../icons";
import type { TopicMessage } from "../protocol";
import { ERROR, PRINTED } from "../program-topics";
import { clock, recordedText } from "../time/format";
import { goalText, onGoal } from "../tools/goal";

/** Limit of entries. */
const MOST = 300;

type Level = "error" | "warning" | "info";

/** The last lines of a run, from number `first` on. Each run has another `run`. */
interface Printed {
  run: number;
  first: number;
  lines: { stamp: { sec: number; nanosec: number }; level: number; msg: string }[];
}

/** The log since the page was opened: refusals, notices, findings, goals and what a program prints, with the simulated time. */
export function log(app: App): HTMLElement {
  const list = h("ol", {});
  const log = h("div", { class: "log", role: "log", "aria-label": "Log", tabindex: 0 }, list);
  let last: { level: Level; text: string; count: HTMLElement; times: number } | null = null;
  const add = (level: Level, text: string, when = moment(app)): void => {
    if (last?.level === level && last.text === text) {
      last.times += 1;
      last.count.textContent = `×${last.times}`;
      return;
    }
    const atEnd = log.scrollTop + log.clientHeight >= log.scrollHeight - 8;
    const count = h("b", {});
    list.append(
      h(
        "li",
        { "data-level": level },
        h("time", {}, when),
        h("span", {}, level !== "info" && icon(level), text, count),
      ),
    );
    last = { level, text, count, times: 1 };
    while (list.childElementCount > MOST) list.firstElementChild?.remove();
    if (atEnd) log.scrollTop = log.scrollHeight;
  };
  app.refused.watch((now) => now && add("warning", now.reason));
  app.notice.watch((now) => now && add("info", now.text));
  app.recorded.watch((now) => now && add("info", recordedText(now)));
  app.connection.link.watch((link) => {
    if (link === "live") add("info", "Connected.");
    if (link === "lost") add("error", "Connection lost.");
  });
  let world = "";
  app.about.watch((about) => {
    if (about?.mode !== "sim" || about.world === world) return;
    world = about.world;
    add("info", `World: ${world}.`);
  });
  let serial: number | null = null;
  app.findings.watch((now) => {
    if (now === null || now.serial === serial) return;
    serial = now.serial;
    for (const { severity, code, message, place } of now.findings) {
      add(severity, `${place === null ? "" : `${baseName(place.file)}:${place.line}: `}${message} [${code}]`);
    }
    if (now.findings.length === 0) add("info", "Description read: no findings.");
  });
  onGoal(app, (state, reason, time) =>
    add(
      state === "stuck" || state === "refused" ? "warning" : "info",
      goalText(state, reason),
      `${time.toFixed(2)} s`,
    ),
  );
  followPrinted(app, add);
  return log;
}

/** Adds what the user's program prints, each line once. */
function followPrinted(app: App, add: (level: Level, text: string, when: string) => void): void {
  let [known, next] = [-1, 0];
  let stop: (() => void) | null = null;
  const receive = ({ message }: TopicMessage): void => {
    const { run, first, lines } = message as unknown as Printed;
    if (run !== known) {
      [known, next] = [run, 0];
      app.printed.set("");
    }
    if (first + lines.length <= next) return; // the page looks back in time
    if (first > next) add("info", `… ${first - next} lines are only in the terminal`, "");
    for (const { stamp, level, msg } of lines.slice(Math.max(0, next - first)))
      add(level >= ERROR ? "error" : "info", msg, `${(stamp.sec + stamp.nanosec * 1e-9).toFixed(2)} s`);
    next = first + lines.length;
    app.printed.set(lines.filter(({ level }) => level < ERROR).at(-1)?.msg ?? ""); // errors have a notice
  };
  app.topics.list.watch((topics) => {
    const exists = topics.some(({ name }) => name === PRINTED);
    if (exists === (stop !== null)) return;
    stop?.();
    stop = exists ? app.topics.subscribe(PRINTED, receive) : null;
  });
}

/** The time of an entry: simulated time, time in the recording, or time of day. */
function moment(app: App): string {
  if (app.about.value?.mode === "sim") return `${(app.state.value?.time ?? 0).toFixed(2)} s`;
  const played = app.travel.timeline.value;
  return played === null ? new Date().toLocaleTimeString() : clock(played.at);
}
