import type { App, Spot } from "../app";
import { baseName, h } from "../dom";
import { icon } from "../icons";
import type { Finding, SourceText } from "../protocol";
import { editNumbers, keepFocus, numbersOf, offer } from "./edit-numbers";
import { highlight } from "./highlight";
import { showHints } from "./hints";

/** Limit of lines shown around the selected one. */
const MOST_LINES = 6000;
let shown: Spot | null = null;

/** The Source panel: the text around a place, with findings in the margin and a caret under the selected one. */
export function source(app: App): HTMLElement {
  const tabs = h("div", { class: "tabs", role: "tablist", "aria-label": "Files" });
  const body = h("div", {
    class: "source-body",
    tabindex: 0,
    role: "group",
    "aria-label": "Source text",
  });
  const undo = h(
    "button",
    { type: "button", class: "icon-button", "aria-label": "Undo", onclick: () => app.send({ type: "undo" }) },
    icon("undo"),
  );
  const redo = h(
    "button",
    { type: "button", class: "icon-button", "aria-label": "Redo", onclick: () => app.send({ type: "redo" }) },
    icon("redo"),
  );
  app.parameters.watch((now) => {
    undo.hidden = !now?.undo;
    undo.title = `Undo: ${now?.undo ?? ""} (Ctrl+Z)`;
    redo.hidden = !now?.redo;
    redo.title = `Redo: ${now?.redo ?? ""} (Ctrl+Shift+Z)`;
  });
  editNumbers(app, body);
  const close = h(
    "button",
    {
      type: "button",
      class: "icon-button",
      title: "Close (Escape)",
      "aria-label": "Close the source",
      onclick: () => app.spot.set(null),
    },
    icon("close"),
  );
  const dock = h(
    "section",
    { id: "source", class: "panel", "aria-label": "Source", hidden: true },
    h("header", { class: "panel-head" }, tabs, undo, redo, close),
    body,
  );
  let drawn: SourceText | null = null;

  const draw = (): void => {
    const spot = app.spot.value;
    dock.hidden = spot === null;
    if (spot === null) return;
    drawTabs(app, tabs, spot.place.file);
    const text = app.sources.value.get(spot.place.file) ?? null;
    let giveBack = (): void => undefined;
    if (!hasSameLines(text, drawn)) {
      if (text?.file !== drawn?.file) shown = null;
      const top = body.scrollTop;
      giveBack = keepFocus(body);
      body.replaceChildren(
        text === null ? h("p", { class: "nothing" }, "Loading…") : lines(app, text, spot.place.line),
      );
      body.scrollTop = top;
    }
    if (text !== null) {
      if (text !== drawn) showHints(body, text.hints);
      mark(app, body, text, spot);
    }
    drawn = text;
    giveBack();
  };
  app.spot.watch(draw);
  app.sources.watch(draw);
  app.findings.watch(draw);
  app.about.watch(draw);
  app.selected.watch(draw);
  return dock;
}

/** Whether a text equals the one shown, apart from its hints. Then the rows stay, and so does an open field. */
function hasSameLines(text: SourceText | null, drawn: SourceText | null): boolean {
  if (text === null || drawn === null) return false;
  return (
    text.file === drawn.file &&
    text.text === drawn.text &&
    JSON.stringify(text.owners) === JSON.stringify(drawn.owners)
  );
}

function drawTabs(app: App, tabs: HTMLElement, open: string): void {
  const files = app.about.value?.files ?? [];
  const shown = files.includes(open) ? files : [...files, open];
  tabs.replaceChildren(
    ...shown.map((file) =>
      h(
        "button",
        {
          type: "button",
          role: "tab",
          "aria-selected": String(file === open),
          title: file,
          onclick: () => app.show({ file, line: 1, column: 1, length: 0 }),
        },
        baseName(file),
      ),
    ),
  );
}

function lines(app: App, text: SourceText, around: number): HTMLElement {
  const all = highlight(text.text);
  const first = all.length > MOST_LINES ? Math.max(0, around - MOST_LINES / 2) : 0;
  const code = h("div", { class: "code", role: "presentation" });
  all.slice(first, first + MOST_LINES).forEach((pieces, index) => {
    const line = first + index + 1;
    const owners = text.owners[line - 1] ?? [];
    const row = h(
      "div",
      { class: "line", "data-line": line, "data-owners": owners.length ? ` ${owners.join(" ")} ` : null },
      h(
        "span",
        { class: "gutter", title: owners.length ? `part of ${owners.join(", ")}` : null },
        String(line),
      ),
      h("span", { class: "text" }, ...pieces),
    );
    if (owners.length)
      row.addEventListener("click", () => getSelection()?.isCollapsed && chooseOwner(app, owners));
    code.append(row);
  });
  return code;
}

/** Selects the link of a line. Repeated clicks on a line with several links select each in turn. */
function chooseOwner(app: App, owners: readonly string[]): void {
  const next = (owners.indexOf(app.selected.value) + 1) % owners.length;
  app.selected.set(owners[next] ?? "");
}

function mark(app: App, body: HTMLElement, text: SourceText, spot: Spot): void {
  for (const old of body.querySelectorAll(".caret")) old.remove();
  const here = new Map<number, Finding>();
  for (const finding of [...(app.findings.value?.findings ?? [])].reverse()) {
    if (finding.place?.file === text.file) here.set(finding.place.line, finding);
  }
  for (const row of body.querySelectorAll<HTMLElement>(".line")) {
    const line = Number(row.dataset["line"]);
    const finding = here.get(line);
    row.classList.toggle("here", line === spot.place.line && spot.place.length > 0);
    row.classList.toggle(
      "owned",
      app.selected.value !== "" && (row.dataset["owners"] ?? "").includes(` ${app.selected.value} `),
    );
    for (const number of numbersOf(row))
      offer(number, app.canWrite && (row.classList.contains("here") || row.classList.contains("owned")));
    if (finding) row.dataset["severity"] = finding.severity;
    else delete row.dataset["severity"];
  }
  const row = body.querySelector<HTMLElement>(`.line[data-line="${spot.place.line}"]`);
  if (row === null) return;
  if (spot.finding !== null)
    row.after(caret(spot.finding, spot, row.querySelector(".text")?.textContent ?? ""));
  if (shown === spot) return; // an edit elsewhere must not scroll the text
  shown = spot;
  const top = row.offsetTop - body.clientHeight / 2 + row.offsetHeight;
  body.scrollTo({ top: Math.max(0, top) });
}

function caret(finding: Finding, spot: Spot, line: string): HTMLElement {
  const { column, length } = spot.place;
  const before = Array.from(line)
    .slice(0, column - 1)
    .map((character) => (character === "\t" ? character : " "))
    .join("");
  return h(
    "div",
    { class: "caret", "data-severity": finding.severity },
    h("span", { class: "gutter" }),
    h(
      "span",
      { class: "text" },
      `${before}${"^".repeat(Math.max(1, length))} `,
      h("span", { class: "says" }, finding.message),
    ),
  );
}
