import type { Hint } from "../protocol";

/** Shows the values of the expressions at the end of each line, and as a tooltip on each expression. */
export function showHints(body: HTMLElement, hints: readonly Hint[]): void {
  const byLine = new Map<number, Hint[]>();
  for (const hint of hints) byLine.set(hint.place.line, [...(byLine.get(hint.place.line) ?? []), hint]);
  for (const row of body.querySelectorAll<HTMLElement>(".line")) {
    const lineHints = byLine.get(Number(row.dataset["line"])) ?? [];
    const text = row.querySelector<HTMLElement>(".text")!;
    if (lineHints.length > 0) text.dataset["hint"] = lineHints.map(hintText).join("  \u00b7  ");
    else delete text.dataset["hint"];
    explain(text, lineHints);
  }
}

/** The values of an expression, one for each macro call with a different value. */
export function hintText({ values, more }: Hint): string {
  return [...values, ...(more ? ["\u2026"] : [])].join(" | ");
}

function explain(text: HTMLElement, hints: readonly Hint[]): void {
  let column = 1;
  for (const piece of text.childNodes) {
    const at = column;
    // a number that is being edited is an input field
    column += Array.from(
      piece instanceof HTMLInputElement ? piece.defaultValue : (piece.textContent ?? ""),
    ).length;
    if (!(piece instanceof HTMLElement) || !piece.classList.contains("t-expression")) continue;
    const hint = hints.find(({ place }) => place.column <= at && at < place.column + place.length);
    piece.title = hint === undefined ? "" : hintText(hint);
  }
}
