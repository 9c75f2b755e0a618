import type { App } from "../app";
import { GLOBALS, KINDS, type DisplayKind } from "../displays/kinds";
import { isInitial, kindOf, valueOf, type DisplayConfig, type Status } from "../displays/set";
import { baseName, h, panel } from "../dom";
import { focusedByKeyboard } from "../focus";
import { icon } from "../icons";
import { extras, type Extra } from "./display-extras";
import { propertyField, type Field } from "./property";

const LEVELS = { ok: "fine", warn: "warning", error: "error", off: "off" } as const;

/** The Displays panel: each display with its status and settings. */
export function displays(app: App): HTMLElement {
  const list = h("ul", { class: "displays", "aria-label": "Displays" });
  const worst = h("span", { class: "counts" });
  const rows = new Map<number, Row>();
  const globals = globalOptions(app);
  list.append(globals);
  app.displays.all.watch((all) => {
    for (const [id, row] of rows) {
      if (all.some((config) => config.id === id)) continue;
      if (row.element.contains(document.activeElement))
        (row.element.nextElementSibling ?? row.element.previousElementSibling)
          ?.querySelector<HTMLElement>(".head")
          ?.focus();
      row.element.remove();
      rows.delete(id);
    }
    const focused = document.activeElement;
    all.forEach((config, index) => {
      let row = rows.get(config.id);
      if (row === undefined) {
        rows.set(config.id, (row = new Row(app, config)));
        row.setStatus(app.statuses.value.get(config.id)); // the status may be older than the row
      }
      row.show(config);
      // the first row holds the global options
      if (list.children[index + 1] !== row.element)
        list.insertBefore(row.element, list.children[index + 1] ?? null);
    });
    if (focused instanceof HTMLElement && focused !== document.activeElement && list.contains(focused))
      focused.focus();
  });
  app.statuses.watch((statuses) => {
    for (const [id, row] of rows) row.setStatus(statuses.get(id));
    const bad = [...statuses.values()].filter(({ level }) => level === "warn" || level === "error");
    const label = `${bad.length} ${bad.length === 1 ? "needs" : "need"} attention`;
    const severity = bad.some(({ level }) => level === "error") ? "error" : "warning";
    worst.replaceChildren(
      ...(bad.length === 0
        ? []
        : [
            h(
              "span",
              { class: "badge", "data-severity": severity, title: label, role: "img", "aria-label": label },
              String(bad.length),
            ),
          ]),
    );
  });
  const refresh = (): void => rows.forEach((row) => row.refresh());
  app.about.watch(refresh);
  app.displayFile.watch(refresh);
  app.topics.list.watch(refresh);
  app.scene.watch(refresh);
  app.namespaces.watch(refresh);
  return panel("displays", "Displays", [worst, files(app), adder(app, (id) => rows.get(id)?.open())], list);
}

/** The menu to save, open and reset all settings. */
function files(app: App): HTMLElement {
  const field = h("select", {
    class: "add",
    "aria-label": "Display settings",
    title: "Open and save display settings",
  });
  const chooser = h("input", {
    type: "file",
    accept: ".yaml,.yml,.rviz",
    hidden: true,
    "aria-label": "Display file",
  });
  chooser.addEventListener("change", () => {
    const file = chooser.files?.[0];
    if (file !== undefined) void file.text().then((text) => app.openDisplays(file.name, text));
    chooser.value = "";
  });
  const actions: Record<string, () => void> = {
    save: () => app.saveDisplays("file"),
    kbot: () => app.saveDisplays("kbot"),
    rviz1: () => app.saveDisplays("rviz1"),
    rviz2: () => app.saveDisplays("rviz2"),
    open: () => chooser.click(),
    reset: () => app.displays.reset(),
  };
  field.addEventListener("change", () => {
    const act = actions[field.value];
    field.value = "";
    act?.();
  });
  app.displayFile.watch((file) => {
    const option = (value: string, text: string): HTMLElement => h("option", { value }, text);
    const own = file === null || file.file === "" ? [] : [option("save", `Save to ${baseName(file.file)}`)];
    field.replaceChildren(
      option("", "File…"),
      ...own,
      option("kbot", "Save a copy (.kbot.yaml)"),
      option("rviz2", "Save a copy for rviz 2 (.rviz)"),
      option("rviz1", "Save a copy for rviz 1 (.rviz)"),
      option("open", "Open a file…"),
      option("reset", "Reset to defaults"),
    );
  });
  return h("span", {}, field, chooser);
}

/** A list to add a display, by kind or by topic. */
function adder(app: App, added: (id: number) => void): HTMLElement {
  const field = h("select", { class: "add", "aria-label": "Add a display", title: "Add a display" });
  const fill = (): void => {
    const taken = (kind: DisplayKind): boolean =>
      kind.single && app.displays.all.value.some((display) => display.kind === kind.name);
    const kinds = KINDS.map((kind) =>
      h("option", { value: kind.name, title: kind.about, disabled: taken(kind) }, kind.name),
    );
    const topics = app.topics.list.value.flatMap((topic) =>
      KINDS.filter((kind) => kind.topics.includes(topic.kind)).map((kind) =>
        h("option", { value: `${kind.name} ${topic.name}` }, `${topic.name} (${kind.name})`),
      ),
    );
    const byTopic = topics.length === 0 ? null : h("optgroup", { label: "By topic" }, ...topics);
    field.replaceChildren(
      h("option", { value: "" }, "Add…"),
      h("optgroup", { label: "By kind" }, ...kinds),
      ...(byTopic === null ? [] : [byTopic]),
    );
  };
  app.displays.all.watch(fill);
  app.topics.list.watch(fill);
  field.addEventListener("change", () => {
    const [kind = "", topic = ""] = field.value.split(" ");
    field.value = "";
    const leftOut = app.displays.all.value.find(
      (display) => display.kind === kind && isLeftOut(app, display),
    );
    if (leftOut !== undefined) {
      app.displays.set(leftOut.id, "topic", topic);
      added(leftOut.id);
      return;
    }
    const made = kind === "" ? null : app.displays.add(kind);
    if (made === null) return;
    if (topic !== "") app.displays.set(made.id, "topic", topic);
    added(made.id);
  });
  return field;
}

/** The global options, as the first row of the list. */
function globalOptions(app: App): HTMLElement {
  const lamp = h("span", { class: "lamp", role: "img" });
  const reason = h("p", { class: "reason" });
  const owner = { kind: "", name: "the view" };
  const fields = GLOBALS.map((property) => ({
    property,
    field: propertyField(app, owner, property, (value) => app.displays.setGlobal(property.name, value)),
  }));
  const notes = h("details", { hidden: true });
  app.displayFile.watch((file) => {
    notes.hidden = file === null || file.notes.length === 0;
    notes.replaceChildren(
      h("summary", {}, `Not supported in ${file?.name ?? ""}`),
      h("ul", { class: "notes" }, ...(file?.notes ?? []).map((note) => h("li", {}, note))),
    );
  });
  const body = h(
    "div",
    { class: "settings", id: "display-globals", hidden: true },
    reason,
    ...fields.map(({ field }) => field.element),
    notes,
  );
  const head = h(
    "button",
    { type: "button", class: "head", "aria-expanded": "false", "aria-controls": body.id },
    icon("chevron"),
    h("span", { class: "name" }, "Global options"),
  );
  let frameNames = "";
  const show = (): void => {
    const frame = String(app.displays.global("frame"));
    const isMissing = frame !== "" && frame !== app.scene.value?.world && !app.frames().includes(frame);
    const text = isMissing ? `frame ${frame} does not exist` : "";
    lamp.dataset["level"] = isMissing ? "error" : "ok";
    lamp.setAttribute("aria-label", isMissing ? `error: ${text}` : "fine");
    reason.textContent = text;
    reason.hidden = text === "";
    reason.dataset["level"] = "error";
    if (!body.hidden)
      for (const { property, field } of fields) field.show(app.displays.global(property.name));
  };
  head.addEventListener("click", () => {
    body.hidden = !body.hidden;
    head.setAttribute("aria-expanded", String(!body.hidden));
    show();
  });
  app.displays.globals.watch(show);
  app.scene.watch(show);
  app.state.watch((state) => {
    const names = state?.frames.map(([name]) => name).join("\n") ?? "";
    if (names === frameNames) return;
    frameNames = names;
    show();
  });
  return h("li", { class: "display globals" }, h("div", { class: "row" }, head, lamp), body);
}

/** A display in the list: name, status and check box; its settings when opened. */
class Row {
  readonly element: HTMLLIElement;
  private readonly head: HTMLButtonElement;
  private readonly name = h("span", { class: "name" });
  private readonly lamp = h("span", { class: "lamp", role: "img" });
  private readonly box: HTMLInputElement;
  private readonly reason = h("p", { class: "reason" });
  private readonly body: HTMLElement;
  private readonly fields = new Map<string, Field>();
  private readonly extras: Extra[];

  constructor(
    private readonly app: App,
    private config: DisplayConfig,
  ) {
    const { id, kind } = config;
    const body = `display-${id}`;
    this.head = h(
      "button",
      {
        type: "button",
        class: "head",
        "aria-expanded": "false",
        "aria-controls": body,
        onclick: () => this.toggle(),
      },
      icon("chevron"),
      this.name,
    );
    this.head.addEventListener("keydown", (event) => this.keys(event));
    this.head.addEventListener("dblclick", () => this.rename());
    this.box = h("input", { type: "checkbox", onchange: () => app.displays.enable(id, this.box.checked) });
    const act = (label: string, image: Parameters<typeof icon>[0], action: () => void): HTMLElement =>
      h(
        "button",
        { type: "button", class: "icon-button", title: label, "aria-label": label, onclick: action },
        icon(image),
      );
    const properties = kindOf(kind).properties.map((property) => {
      const field = propertyField(app, config, property, (value) =>
        app.displays.set(id, property.name, value),
      );
      this.fields.set(property.name, field);
      return field.element;
    });
    this.extras = extras(app, kind);
    const actions = h(
      "div",
      { class: "actions" },
      act("Move up (Alt+Up)", "up", () => app.displays.move(id, -1)),
      act("Move down (Alt+Down)", "down", () => app.displays.move(id, 1)),
      act("Rename (F2)", "pencil", () => this.rename()),
      act("Remove (Delete)", "close", () => app.displays.remove(id)),
    );
    this.body = h(
      "div",
      { class: "settings", id: body, hidden: true },
      this.reason,
      ...properties,
      ...this.extras.map((extra) => extra.element),
      actions,
    );
    this.element = h(
      "li",
      { class: "display", "data-display": kind },
      h("div", { class: "row" }, this.head, this.lamp, this.box),
      this.body,
    );
  }

  show(config: DisplayConfig): void {
    this.config = config;
    this.name.textContent = config.name;
    this.box.checked = config.enabled;
    this.box.setAttribute("aria-label", `Show ${config.name}`);
    this.element.classList.toggle("off", !config.enabled);
    this.refresh();
  }

  /** Updates the row, and the fields and the lists if it is open. */
  refresh(): void {
    this.element.hidden = isLeftOut(this.app, this.config);
    if (this.body.hidden) return;
    for (const property of kindOf(this.config.kind).properties)
      this.fields.get(property.name)?.show(valueOf(this.config, property));
    for (const extra of this.extras) extra.show(this.config);
  }

  setStatus(status: Status | undefined): void {
    const { level, reason } = status ?? { level: "off", reason: "" };
    this.lamp.dataset["level"] = level;
    this.lamp.title = reason || LEVELS[level];
    this.lamp.setAttribute("aria-label", `${LEVELS[level]}${reason && `: ${reason}`}`);
    this.reason.textContent = reason;
    this.reason.hidden = reason === "";
    this.reason.dataset["level"] = level;
  }

  open(): void {
    if (this.body.hidden) this.toggle();
    this.head.focus();
    this.element.scrollIntoView({ block: "nearest" });
  }

  /** The next or previous row that is not hidden. */
  private neighbour(step: 1 | -1): HTMLElement | null {
    let row: Element | null = this.element;
    do row = step > 0 ? row.nextElementSibling : row.previousElementSibling;
    while (row instanceof HTMLElement && row.hidden);
    return row as HTMLElement | null;
  }

  private toggle(): void {
    this.unfold(Boolean(this.body.hidden));
  }

  private unfold(on: boolean): void {
    if (on !== this.body.hidden) return;
    this.body.hidden = !on;
    this.head.setAttribute("aria-expanded", String(on));
    this.refresh();
  }

  private keys(event: KeyboardEvent): void {
    const { displays } = this.app;
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key] as 1 | -1 | undefined;
    if (step !== undefined && event.altKey) displays.move(this.config.id, step);
    else if (step !== undefined && focusedByKeyboard())
      this.neighbour(step)?.querySelector<HTMLElement>(".head")?.focus();
    else if (event.key === "ArrowRight" && focusedByKeyboard()) this.unfold(true);
    else if (event.key === "ArrowLeft" && focusedByKeyboard()) this.unfold(false);
    else if (event.key === "Delete") displays.remove(this.config.id);
    else if (event.key === "F2") this.rename();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Replaces the name by a field until Enter, Escape or a click elsewhere. */
  private rename(): void {
    const field = h("input", {
      type: "text",
      class: "rename",
      "aria-label": `Name of ${this.config.name}`,
      value: this.config.name,
    });
    let isOpen = true;
    const end = (keep: boolean): void => {
      if (!isOpen) return;
      isOpen = false; // removing the field blurs it, which would end it again
      field.replaceWith(this.head);
      if (keep) this.app.displays.rename(this.config.id, field.value);
    };
    field.addEventListener("blur", () => end(true));
    field.addEventListener("keydown", (event) => {
      event.stopPropagation();
      if (event.key !== "Enter" && event.key !== "Escape") return;
      end(event.key === "Enter");
      this.head.focus();
    });
    this.head.replaceWith(field);
    field.select();
  }
}

/** Whether the list leaves out a display: an initial one that has nothing to show. A display file is listed in full. */
function isLeftOut(app: App, display: DisplayConfig): boolean {
  return !app.displayFile.value?.name && isInitial(display) && hasNothing(app, display.kind);
}

function hasNothing(app: App, kind: string): boolean {
  switch (kind) {
    case "Trail":
      return (app.about.value?.mode ?? "view") === "view";
    case "World":
      return (app.scene.value?.bodies.length ?? 0) === 0;
    case "LaserScan":
      return app.topics.firstOfType(kindOf(kind).topics) === "";
    default:
      return false;
  }
}
