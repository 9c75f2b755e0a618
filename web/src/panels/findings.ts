import type { App } from "../app";
import { baseName, h, ofNow, panel } from "../dom";
import { icon } from "../icons";
import type { Finding, RulePage } from "../protocol";

/** The Findings panel, most severe first. A click shows a finding's line and link. */
export function findings(app: App): HTMLElement {
  const list = h("ul", { class: "findings" });
  const counts = h("span", { class: "counts" });
  const draw = (): void => {
    if (app.findings.value === null) return;
    const found = bySeverity(app.shownFindings);
    counts.replaceChildren(...badges(found));
    list.replaceChildren(...(found.length ? found.map((finding) => card(app, finding)) : [nothing()]));
    markChosen();
  };
  const markChosen = (): void => {
    const chosen = app.spot.value?.finding ?? null;
    for (const item of list.querySelectorAll<HTMLElement>("li[data-code]"))
      item.classList.toggle("chosen", chosen !== null && item.dataset["key"] === key(chosen));
  };
  app.findings.watch(draw);
  app.drafts.findings.watch(draw);
  app.spot.watch(markChosen);
  return panel("findings", "Findings", [ofNow(), counts], list);
}

/** Findings in the order of their severity. Of the same severity, those about a run come last. */
function bySeverity(all: readonly Finding[]): Finding[] {
  const order = ["error", "warning", "info"];
  return [...all].sort((a, b) => order.indexOf(a.severity) - order.indexOf(b.severity));
}

function card(app: App, finding: Finding): HTMLElement {
  const where = finding.place;
  const item = h(
    "li",
    { "data-code": finding.code, "data-severity": finding.severity, "data-key": key(finding) },
    h(
      "button",
      { type: "button", class: "finding", onclick: () => app.selectFinding(finding) },
      icon(finding.severity),
      h(
        "span",
        { class: "what" },
        h("span", { class: "message" }, finding.message),
        h(
          "span",
          { class: "where" },
          h("span", { class: "code" }, finding.code),
          where && ` ${baseName(where.file)}:${where.line}:${where.column}`,
        ),
        finding.hint !== "" && h("span", { class: "hint" }, finding.hint),
      ),
    ),
  );
  if (finding.fix !== "" && app.canWrite) {
    item.append(
      h(
        "button",
        {
          type: "button",
          class: "fix",
          title: app.drafts.isEmpty ? "Apply this fix to the file" : "Apply this fix to the unsaved text",
          onclick: () => app.applyFix(finding),
        },
        icon("wand"),
        finding.fix,
      ),
    );
  }
  if (finding.stack.length || finding.related.length) item.append(more(app, finding));
  if (app.connection.writes) item.append(explanation(app, finding.code));
  return item;
}

/** Codes whose explanation is open. The list is drawn again at each change of the findings. */
const explained = new Set<string>();

/** Why a rule exists and how its findings are fixed, requested when it is opened. */
function explanation(app: App, code: string): HTMLElement {
  const text = h("div", { class: "rule-page" });
  const show = (page: RulePage | undefined): void =>
    text.replaceChildren(...(page === undefined ? [h("p", {}, "Loading…")] : sections(page)));
  const element = h("details", { class: "why", open: explained.has(code) }, h("summary", {}, "Why?"), text);
  const open = (): void => {
    const page = app.rules.value.get(code);
    show(page);
    if (page !== undefined) return;
    const stop = app.rules.watch((pages) => {
      const page = pages.get(code);
      if (page === undefined) return;
      show(page);
      queueMicrotask(() => stop());
    });
    app.send({ type: "ask_rule", code });
  };
  if (element.open) open();
  element.addEventListener("toggle", () => {
    if (element.open === explained.has(code)) return;
    if (element.open) {
      explained.add(code);
      open();
    } else explained.delete(code);
  });
  return element;
}

/** The sections of a rule's page that help with a finding. What is wrong is in the finding itself. */
function sections({ sections }: RulePage): HTMLElement[] {
  return sections
    .filter(({ title }) => title === "Why" || title === "Example" || title === "Fix")
    .map(({ title, text }) => h("p", {}, h("b", {}, title), ...inCode(text)));
}

/** Text whose parts between backquotes are code. */
function inCode(text: string): (Node | string)[] {
  return text.split("`").map((part, index) => (index % 2 === 1 ? h("code", {}, part) : ` ${part.trim()} `));
}

function more(app: App, finding: Finding): HTMLElement {
  const lines = [
    ...finding.stack.map((step) => ({
      text: `${step.kind === "macro" ? "in macro" : "in include of"} ${baseName(step.name)}`,
      place: step.place,
    })),
    ...finding.related.map((note) => ({ text: note.message, place: note.place })),
  ];
  return h(
    "ul",
    { class: "more" },
    ...lines.map(({ text, place }) =>
      h(
        "li",
        {},
        h(
          "button",
          { type: "button", onclick: () => app.show(place, null) },
          `${text} `,
          h("span", { class: "where" }, `${baseName(place.file)}:${place.line}`),
        ),
      ),
    ),
  );
}

function badges(found: readonly Finding[]): HTMLElement[] {
  return (["error", "warning", "info"] as const).flatMap((severity) => {
    const count = found.filter((finding) => finding.severity === severity).length;
    const label = severity === "info" ? `${count} notes` : `${count} ${severity}${count === 1 ? "" : "s"}`;
    return count === 0
      ? []
      : [
          h(
            "span",
            { class: "badge", "data-severity": severity, title: label, "aria-label": label },
            String(count),
          ),
        ];
  });
}

function nothing(): HTMLElement {
  return h("li", { class: "nothing" }, icon("check"), "No findings.");
}

function key({ code, place, message }: Finding): string {
  return JSON.stringify([code, place?.file, place?.line, place?.column, message]);
}
