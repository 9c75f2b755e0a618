import type { App } from "../app";
import { baseName, h, ofNow, panel } from "../dom";
import { icon } from "../icons";
import type { Finding, Findings } from "../protocol";

/** The Findings panel, most severe first. A click shows a finding's line and link. */
export function findings(app: App): HTMLElement {
  const list = h("ul", { class: "findings" });
  const counts = h("span", { class: "counts" });
  app.findings.watch((now) => {
    if (now === null) return;
    counts.replaceChildren(...badges(now));
    list.replaceChildren(
      ...(now.findings.length
        ? bySeverity(now.findings).map(([finding, index]) => card(app, finding, now.serial, index))
        : [nothing()]),
    );
  });
  app.spot.watch((spot) => {
    for (const item of list.querySelectorAll<HTMLElement>("li[data-code]")) {
      item.classList.toggle("chosen", spot?.finding != null && item.dataset["key"] === key(spot.finding));
    }
  });
  return panel("findings", "Findings", [ofNow(), counts], list);
}

/** Findings with their numbers, which the server knows them by. Those about a run come last. */
function bySeverity(all: readonly Finding[]): [Finding, number][] {
  const order = ["error", "warning", "info"];
  return all
    .map((finding, index): [Finding, number] => [finding, index])
    .sort(([a], [b]) => order.indexOf(a.severity) - order.indexOf(b.severity));
}

function card(app: App, finding: Finding, serial: number, index: number): HTMLElement {
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
    const apply = (): void => app.send({ type: "apply_fix", serial, index });
    item.append(
      h(
        "button",
        { type: "button", class: "fix", title: "Apply this fix to the file", onclick: apply },
        icon("wand"),
        finding.fix,
      ),
    );
  }
  if (finding.stack.length || finding.related.length) item.append(more(app, finding));
  return item;
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

function badges(now: Findings): HTMLElement[] {
  return (["error", "warning", "info"] as const).flatMap((severity) => {
    const count = now.findings.filter((finding) => finding.severity === severity).length;
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
