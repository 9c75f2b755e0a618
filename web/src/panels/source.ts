import type { App } from "../app";
import { baseName, h } from "../dom";
import type { Editor } from "../editor/editor";
import { icon } from "../icons";

/** The Source panel: the files of the description in a text editor, which is loaded when the panel first opens. */
export function source(app: App): HTMLElement {
  const { drafts, spot } = app;
  let editor: Editor | null = null;
  const tabs = h("div", { class: "tabs", role: "tablist", "aria-label": "Files" });
  const note = h("p", { class: "source-note", role: "status", hidden: true });
  const loading = h("p", { class: "nothing" }, "Loading…");
  const text = h("div", { class: "source-text" });
  const openFile = (): string => spot.value?.place.file ?? "";
  const undo = button("undo", "Undo", () => editor?.undo());
  const redo = button("redo", "Redo", () => editor?.redo());
  const save = h(
    "button",
    { type: "button", class: "save", title: "Save the file (Ctrl+S)", onclick: () => app.save(openFile()) },
    "Save",
  );
  const tall = button("up", "Taller", () => {
    const isTall = dock.classList.toggle("tall");
    tall.setAttribute("aria-pressed", String(isTall));
  });
  tall.setAttribute("aria-pressed", "false");
  const close = button("close", "Close the source", () => spot.set(null));
  close.title = "Close (Escape)";
  const dock = h(
    "section",
    { id: "source", class: "panel", "aria-label": "Source", hidden: true },
    h("header", { class: "panel-head" }, tabs, save, undo, redo, tall, close),
    note,
    loading,
    text,
  );

  const leave = (): void => tabs.querySelector<HTMLElement>("[aria-selected=true]")?.focus();
  const showHistory = (): void => {
    const { value: server } = app.parameters;
    const isSaved = !drafts.files.value.has(openFile());
    const { history } = editor ?? { history: { undo: Boolean(server?.undo), redo: Boolean(server?.redo) } };
    undo.hidden = !history.undo;
    redo.hidden = !history.redo;
    undo.title = isSaved && server?.undo ? `Undo: ${server.undo} (Ctrl+Z)` : "Undo (Ctrl+Z)";
    redo.title = isSaved && server?.redo ? `Redo: ${server.redo} (Ctrl+Shift+Z)` : "Redo (Ctrl+Shift+Z)";
  };
  let isLoading = false;
  const load = async (): Promise<void> => {
    isLoading = true;
    const { createEditor } = await import("../editor/editor");
    loading.hidden = true; // hidden text cannot take the focus
    text.hidden = false;
    editor = createEditor(app, text, leave, showHistory);
    draw();
  };
  const draw = (): void => {
    dock.hidden = spot.value === null;
    if (spot.value === null) return;
    if (!isLoading) void load();
    const { file } = spot.value.place;
    const isRead = app.sources.value.has(file) || drafts.files.value.has(file);
    text.hidden = editor === null || !isRead;
    loading.hidden = !text.hidden || drafts.isDeleted(file);
    drawTabs(app, tabs, file);
    const reason = app.canWrite ? (app.sources.value.get(file)?.read_only ?? "") : whyReadOnly(app);
    save.hidden = reason !== "";
    save.disabled = !drafts.toSave.has(file);
    drawNote(app, note, file, reason);
    showHistory();
  };
  for (const signal of [spot, app.sources, app.about, drafts.files, drafts.conflict, app.parameters])
    signal.watch(draw);
  addEventListener("beforeunload", (event) => drafts.isEmpty || event.preventDefault());
  return dock;
}

function button(
  image: "undo" | "redo" | "up" | "close",
  label: string,
  click: () => void,
): HTMLButtonElement {
  return h(
    "button",
    { type: "button", class: "icon-button", title: label, "aria-label": label, onclick: click },
    icon(image),
  );
}

function drawTabs(app: App, tabs: HTMLElement, open: string): void {
  const files = app.about.value?.files ?? [];
  const unsaved = app.drafts.files.value;
  const shown = new Set([...files, ...unsaved.keys(), open]);
  const isFocused = tabs.contains(document.activeElement);
  tabs.replaceChildren(
    ...[...shown].map((file) =>
      h(
        "button",
        {
          type: "button",
          role: "tab",
          "aria-selected": String(file === open),
          tabindex: file === open ? 0 : -1,
          title: unsaved.has(file) ? `${file} (unsaved)` : file,
          onclick: () => file !== open && app.show({ file, line: 1, column: 1, length: 0 }),
          onkeydown: (event: KeyboardEvent) => moveTab(event),
        },
        baseName(file),
        unsaved.has(file) && h("span", { class: "unsaved", role: "img", "aria-label": "unsaved" }),
      ),
    ),
  );
  if (isFocused) tabs.querySelector<HTMLElement>("[aria-selected=true]")?.focus();
}

/** Moves between tabs with the arrow keys. */
function moveTab(event: KeyboardEvent): void {
  const tab = event.currentTarget as HTMLElement;
  const other =
    event.key === "ArrowRight"
      ? tab.nextElementSibling
      : event.key === "ArrowLeft"
        ? tab.previousElementSibling
        : null;
  if (!(other instanceof HTMLElement)) return;
  event.preventDefault();
  event.stopPropagation();
  other.focus();
  other.click();
}

function whyReadOnly(app: App): string {
  return app.about.value?.mode === "play"
    ? "the robot is part of a recording"
    : "this page was saved as a file and has no server";
}

/** Shows why the text cannot be saved, or what another program has changed. */
function drawNote(app: App, note: HTMLElement, file: string, reason: string): void {
  const { drafts } = app;
  const name = baseName(file);
  const content: (Node | string)[] = [];
  if (reason !== "") content.push(`Read only: ${reason}.`);
  else if (drafts.isDeleted(file))
    content.push(
      `${name} was deleted. ${drafts.toSave.has(file) ? "Save writes it again" : "Restore it to edit it"}.`,
    );
  else if (drafts.conflict.value?.file === file)
    content.push(
      `Not saved: another program has changed the same lines of ${name}. `,
      h("button", { type: "button", onclick: () => drafts.keepMine() }, "Keep my text"),
      h("button", { type: "button", onclick: () => drafts.takeTheirs() }, "Use the text of the file"),
    );
  else if (drafts.files.value.get(file)?.isOutdated)
    content.push(`Another program has changed ${name}. Saving keeps its changes at other lines.`);
  note.hidden = content.length === 0;
  note.classList.toggle("warning", reason === "");
  note.replaceChildren(...content);
}
