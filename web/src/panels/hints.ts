import type { Hint } from "../protocol";

/** Says behind each line what the expressions in it came to; to who points at one, what its own attribute did. */
export function tellHints(body: HTMLElement, hints: readonly Hint[]): void {
  const byLine = new Map<number, Hint[]>();
  for (const hint of hints) byLine.set(hint.place.line, [...(byLine.get(hint.place.line) ?? []), hint]);
  for (const row of body.querySelectorAll<HTMLElement>(".line")) {
    const told = byLine.get(Number(row.dataset["line"])) ?? [];
    const text = row.querySelector<HTMLElement>(".text")!;
    if (told.length > 0) text.dataset["hint"] = told.map(worded).join("  \u00b7  ");
    else delete text.dataset["hint"];
    explain(text, told);
  }
}

/** What an expression came to, for each macro call that made another value of it. */
export function worded({ values, more }: Hint): string {
  return [...values, ...(more ? ["\u2026"] : [])].join(" | ");
}

function explain(text: HTMLElement, hints: readonly Hint[]): void {
  let column = 1;
  for (const piece of text.childNodes) {
    const at = column;
    // a number that is being changed is a field
    column += Array.from(
      piece instanceof HTMLInputElement ? piece.defaultValue : (piece.textContent ?? ""),
    ).length;
    if (!(piece instanceof HTMLElement) || !piece.classList.contains("t-expression")) continue;
    const hint = hints.find(({ place }) => place.column <= at && at < place.column + place.length);
    piece.title = hint === undefined ? "" : worded(hint);
  }
}
