import { h } from "../dom";
import { icon } from "../icons";
import type { Bookmark } from "./bookmarks";
import type { TimeTravel } from "./travel";

/** The bookmarks along the track; they are pressed in the list, with keys too. */
export function marks(travel: TimeTravel): HTMLElement {
  const holder = h("div", { class: "marks", "aria-hidden": "true" });
  const draw = (): void => {
    const now = travel.timeline.value;
    const full = now === null ? 0 : now.end - now.start;
    const seen = now === null || full <= 0 ? [] : travel.bookmarks.all.value.filter(({ at }) => at >= now.start);
    while (holder.childElementCount > seen.length) holder.lastElementChild!.remove();
    while (holder.childElementCount < seen.length) holder.append(h("i"));
    seen.forEach(({ at }, index) => (holder.children[index] as HTMLElement).style.setProperty("--at", String((at - now!.start) / full)));
  };
  travel.timeline.watch(draw);
  travel.bookmarks.all.watch(draw);
  return holder;
}

/** The bookmarks with their notes, to go to, to write on and to throw away. */
export function bookmarkList(travel: TimeTravel): HTMLElement {
  const list = h("ul");
  const holder = h("div", { id: "bookmarks", class: "bookmarks", popover: "auto", role: "dialog", "aria-label": "Bookmarks" }, list);
  travel.bookmarks.all.watch((all) => list.replaceChildren(...all.map((one) => row(travel, one))));
  return holder;
}

function row(travel: TimeTravel, one: Bookmark): HTMLElement {
  const note = h("input", { type: "text", value: one.note, maxlength: 200, "aria-label": `Note at ${one.time.toFixed(2)} s` });
  note.addEventListener("change", () => travel.bookmarks.note(one, note.value));
  return h(
    "li",
    {},
    h("button", { type: "button", class: "time", title: "Go there", "aria-label": `Go to ${one.note} at ${one.time.toFixed(2)} s`, onclick: () => travel.seek(one.at) }, `${one.time.toFixed(2)} s`),
    note,
    h("button", { type: "button", class: "icon-button", title: "Remove", "aria-label": `Remove ${one.note}`, onclick: () => travel.bookmarks.remove(one) }, icon("close")),
  );
}
