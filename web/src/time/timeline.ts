import type { App } from "../app";
import { baseName, h, readout, toggle } from "../dom";
import { takesKeys } from "../focus";
import { sliderHold } from "../slider-hold";
import { icon } from "../icons";
import type { RecordingView, Timeline } from "../protocol";
import { bookmarkList, marks } from "./marks";
import { ago, bytes, clock } from "./format";

/** Milliseconds between two updates for screen readers while the time runs. */
const ANNOUNCE_EVERY = 1000;
const STEPS: Record<string, 1 | -1> = { ArrowLeft: -1, ArrowRight: 1, ArrowDown: -1, ArrowUp: 1 };

/** The timeline: the last minutes of a simulation, or a recording. */
export function timelineBar(app: App): HTMLElement {
  const { travel } = app;
  const slider = h("input", {
    type: "range",
    class: "track",
    min: 0,
    max: 0,
    step: 0.001,
    value: 0,
    "aria-label": "Time shown",
  });
  slider.addEventListener("input", () => {
    const now = travel.timeline.value;
    if (now === null) return;
    const isEnd = slider.valueAsNumber >= Number(slider.max) - 0.03;
    if (isEnd && !now.played) travel.goLive();
    else travel.seek(slider.valueAsNumber);
    describe(now, isEnd, slider.valueAsNumber);
  });
  slider.addEventListener("keydown", (event) => {
    const direction = STEPS[event.key];
    if (direction === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    travel.step(direction);
  });
  // in the past the arrow keys step through time, even if the slider was moved by pointer; live they drive the robot
  addEventListener("keydown", (event) => {
    const isAcross = event.key === "ArrowLeft" || event.key === "ArrowRight";
    if (
      !isAcross ||
      !travel.showsHistory ||
      event.defaultPrevented ||
      takesKeys(event) ||
      event.target instanceof HTMLCanvasElement
    )
      return;
    if (event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    event.preventDefault();
    travel.step(STEPS[event.key]!);
  });
  const where = readout("How long ago", { class: "where" });
  const live = h(
    "button",
    { type: "button", class: "live", title: "Return to live (Escape)", onclick: () => travel.goLive() },
    "Live",
  );
  const resume = h(
    "button",
    {
      type: "button",
      class: "live resume",
      title: "Resume from here: continue the simulation from the time shown",
      "aria-label": "Resume from here",
      hidden: true,
      onclick: () => travel.resume(),
    },
    icon("branch"),
    h("span", {}, "Resume from here"),
  );
  const record = h(
    "button",
    { type: "button", class: "icon-button record", onclick: () => travel.toggleRecording() },
    icon("record"),
  );
  const recording = h("span", { class: "recording", role: "status", hidden: true });
  const loop = toggle(
    "Loop",
    "Repeat the recording",
    false,
    (on) => app.send({ type: "set_loop", loop: on }),
    icon("loop"),
  );
  const add = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Bookmark this time (K)",
      "aria-label": "Bookmark this time",
      onclick: () => travel.mark(),
    },
    icon("flag"),
  );
  const list = bookmarkList(app);
  const show = h("button", { type: "button", class: "marked", popovertarget: list.id, hidden: true });
  list.addEventListener("beforetoggle", () => {
    const { right, top } = bar.getBoundingClientRect();
    list.style.right = `${Math.max(8, innerWidth - right + 8)}px`;
    list.style.bottom = `${innerHeight - top + 8}px`;
  });
  travel.bookmarks.all.watch((all) => {
    show.hidden = all.length === 0;
    show.textContent = String(all.length);
    show.setAttribute(
      "aria-label",
      `${all.length} ${all.length === 1 ? "bookmark" : "bookmarks"}: [ and ] go to them`,
    );
    show.title = "Bookmarks ([ and ] go to them)";
  });
  const bar = h(
    "div",
    { class: "timeline", role: "group", "aria-label": "Timeline", hidden: true },
    record,
    recording,
    h("div", { class: "track-holder" }, marks(app), slider),
    where,
    loop,
    resume,
    live,
    add,
    show,
    list,
  );

  let announcedAt = -Infinity;
  const describe = (now: Timeline, isLive: boolean, at: number): void => {
    const full = Number(slider.max) - now.start;
    slider.style.setProperty("--part", String(full > 0 ? (at - now.start) / full : 1));
    where.textContent = now.played
      ? `${clock(at)} / ${clock(now.end)}`
      : isLive
        ? ""
        : `\u2212${clock(now.end - at)}`;
    if (isLive && !now.paused && performance.now() - announcedAt < ANNOUNCE_EVERY) return;
    announcedAt = performance.now();
    const time = `${(app.state.value?.time ?? 0).toFixed(2)} s`; // simulated time: after a reset it differs from timeline time
    slider.setAttribute(
      "aria-valuetext",
      now.played ? `${clock(at)} of ${clock(now.end)}` : `${time}, ${isLive ? "live" : ago(now.end - at)}`,
    );
  };
  /** Moves the thumb to the time shown, unless the user holds it. The time shown may differ from the one requested. */
  const follow = (): void => {
    const now = travel.timeline.value;
    if (now === null || isHeld()) return;
    const { awaited } = travel;
    const isLive = now.live && !now.played && awaited === null;
    const at = awaited ?? (isLive ? travel.newest(now) : now.at);
    slider.max = String(isLive ? at : now.end);
    slider.value = String(at);
    describe(now, isLive, at);
  };
  const isHeld = sliderHold(slider, follow);
  app.state.watchThrottled(follow);
  let shown: string | null = null;
  travel.timeline.watch((now) => {
    bar.hidden = now === null || (app.about.value?.mode ?? "view") === "view";
    if (now === null) return;
    slider.min = String(now.start);
    slider.max = String(Math.max(now.end, now.live && !now.played ? Number(slider.max) : 0));
    document.documentElement.dataset["time"] = now.live ? "now" : "past";
    follow();
    live.hidden = now.played;
    resume.hidden = now.played;
    resume.classList.toggle("away", now.live); // the hidden button keeps its place, so that the slider does not move under the pointer
    live.setAttribute("aria-pressed", String(now.live));
    loop.hidden = !now.played;
    loop.setAttribute("aria-pressed", String(now.loop));
    record.hidden = now.played;
    showRecording(now.recording);
  });

  function showRecording(now: RecordingView | null): void {
    recording.hidden = now === null;
    record.setAttribute("aria-pressed", String(now !== null));
    record.title =
      now === null
        ? `Record to a new file in ${app.about.value?.folder ?? ""}`
        : `Stop recording to ${now.file}`;
    record.setAttribute("aria-label", now === null ? "Record" : "Stop recording");
    const before = shown;
    shown = now?.file ?? "";
    if (now === null) return;
    if (before !== shown)
      recording.replaceChildren(
        h("span", { class: "name", title: now.file }, baseName(now.file)),
        h("span", { class: "size", "aria-live": "off" }),
        h("span", { class: "bytes", "aria-live": "off" }),
      );
    if (before === "") app.notice.set({ text: `Recording to ${now.file}` });
    recording.children[1]!.textContent = clock(now.seconds);
    recording.children[2]!.textContent = bytes(now.bytes);
  }
  return bar;
}
