import type { App } from "../app";
import { h } from "../dom";
import { icon } from "../icons";
import type { Bookmark } from "../protocol";
import { clock } from "./format";

/** The marks of the bookmarks on the track. They cannot be clicked; the list of bookmarks can, also by keyboard. */
export function marks({ travel }: App): HTMLElement {
  const holder = h("div", { class: "marks", "aria-hidden": "true" });
  const draw = (): void => {
    const now = travel.timeline.value;
    const full = now === null ? 0 : now.end - now.start;
    const visible =
      now === null || full <= 0 ? [] : travel.bookmarks.all.value.filter(({ at }) => at >= now.start);
    while (holder.childElementCount > visible.length) holder.lastElementChild!.remove();
    while (holder.childElementCount < visible.length) holder.append(h("i"));
    visible.forEach(({ at }, index) =>
      (holder.children[index] as HTMLElement).style.setProperty("--at", String((at - now!.start) / full)),
    );
  };
  travel.timeline.watch(draw);
  travel.bookmarks.all.watch(draw);
  return holder;
}

/** The list of bookmarks with their notes, which the user can visit, edit and remove. */
export function bookmarkList(app: App): HTMLElement {
  const { travel } = app;
  const list = h("ul");
  const holder = h(
    "div",
    { id: "bookmarks", class: "bookmarks", popover: "auto", role: "dialog", "aria-label": "Bookmarks" },
    list,
  );
  let rows = new Map<number, Row>();
  const age = (): void => rows.forEach((row) => row.age(travel.timeline.value?.start ?? 0));
  travel.bookmarks.all.watch((all) => {
    // a row keeps its element, so that the user can go on typing when another tab adds a bookmark
    rows = new Map(
      all.map((bookmark) => [bookmark.number, rows.get(bookmark.number) ?? new Row(app, bookmark)]),
    );
    const focused = [...list.children].findIndex((element) => element.contains(document.activeElement));
    all.forEach((bookmark, index) => {
      const row = rows.get(bookmark.number)!;
      row.update(bookmark);
      if (list.children[index] !== row.element) list.insertBefore(row.element, list.children[index] ?? null);
    });
    while (list.childElementCount > all.length) list.lastElementChild!.remove();
    if (focused >= 0 && !list.contains(document.activeElement))
      list.children[Math.min(focused, all.length - 1)]?.querySelector("button")?.focus();
    if (all.length === 0 && holder.matches(":popover-open")) holder.hidePopover();
    age();
  });
  travel.timeline.watch(age);
  return holder;
}

class Row {
  readonly element: HTMLElement;
  private readonly go: HTMLButtonElement;
  private readonly note: HTMLInputElement;
  private readonly remove: HTMLButtonElement;

  constructor(
    private readonly app: App,
    private bookmark: Bookmark,
  ) {
    const { number, at } = bookmark;
    const shown = this.when();
    this.go = h("button", { type: "button", class: "time", onclick: () => app.travel.seek(at) }, shown);
    this.note = h("input", {
      type: "text",
      maxlength: 200,
      "aria-label": `Note at ${shown}`,
      onchange: () => app.send({ type: "note_mark", number, note: this.note.value }),
    });
    this.remove = h(
      "button",
      {
        type: "button",
        class: "icon-button",
        title: "Remove",
        onclick: () => app.send({ type: "remove_mark", number }),
      },
      icon("close"),
    );
    this.element = h("li", {}, this.go, this.note, this.remove);
  }

  update(bookmark: Bookmark): void {
    this.bookmark = bookmark;
    if (document.activeElement !== this.note) this.note.value = bookmark.note;
    this.go.setAttribute("aria-label", `Go to ${bookmark.note} at ${this.when()}`);
    this.remove.setAttribute("aria-label", `Remove ${bookmark.note}`);
  }

  /** The simulated time, or the time in a recording, as shown elsewhere on the page. */
  private when(): string {
    return this.app.about.value?.mode === "play"
      ? clock(this.bookmark.at)
      : `${this.bookmark.time.toFixed(2)} s`;
  }

  /** Disables the button if the time is no longer stored. The note stays. */
  age(start: number): void {
    this.go.disabled = this.bookmark.at < start;
    this.go.title = this.go.disabled ? "This time is no longer stored" : "Go to this time";
  }
}
