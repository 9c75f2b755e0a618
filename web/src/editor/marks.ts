import {
  RangeSet,
  RangeValue,
  StateEffect,
  StateField,
  type EditorState,
  type Extension,
  type Range,
  type Text,
} from "@codemirror/state";
import { Decoration, EditorView, WidgetType, type DecorationSet } from "@codemirror/view";

import type { Spot } from "../app";
import { h } from "../dom";
import type { Finding, Hint, SourceText } from "../protocol";
import { rangeOf } from "./positions";

/** The links that a line belongs to. */
class Owners extends RangeValue {
  constructor(readonly names: readonly string[]) {
    super();
  }
}

/** The values of an expression. */
class Value extends RangeValue {
  constructor(readonly text: string) {
    super();
  }
}

/** What the server reports about a text, at its current offsets: the links of its lines, and values of expressions. */
interface Known {
  owners: RangeSet<Owners>;
  values: RangeSet<Value>;
}

/** What is marked: the selected place with its finding, and the lines of the selected link. */
export interface Marked {
  spot: Spot | null;
  link: string;
}

export const setKnown = StateEffect.define<SourceText>();
export const setMarked = StateEffect.define<Marked>();

const known = StateField.define<Known>({
  create: () => ({ owners: RangeSet.of<Owners>([]), values: RangeSet.of<Value>([]) }),
  update(value, transaction) {
    let { owners, values } = value;
    if (transaction.docChanged) {
      owners = owners.map(transaction.changes);
      values = values.map(transaction.changes);
      // the values on a changed line may be wrong until the text is saved
      transaction.changes.iterChangedRanges((_from, _to, from, to) => {
        const first = transaction.state.doc.lineAt(from).from;
        const last = transaction.state.doc.lineAt(to).to;
        values = values.update({ filter: (at) => at < first || at > last });
      });
    }
    for (const effect of transaction.effects)
      if (effect.is(setKnown)) ({ owners, values } = knownOf(transaction.state.doc, effect.value));
    return { owners, values };
  },
});

function knownOf(doc: Text, source: SourceText): Known {
  const owners: Range<Owners>[] = [];
  source.owners.slice(0, doc.lines).forEach((names, index) => {
    if (names.length > 0) owners.push(new Owners(names).range(doc.line(index + 1).from));
  });
  const values = source.hints.map((hint) => {
    const { from, to } = rangeOf(doc, hint.place);
    return new Value(hintText(hint)).range(from, to);
  });
  return { owners: RangeSet.of(owners, true), values: RangeSet.of(values, true) };
}

/** The spot's range is kept as text changes. */
const marked = StateField.define<Marked & { from: number; to: number }>({
  create: () => ({ spot: null, link: "", from: 0, to: 0 }),
  update(value, transaction) {
    let { spot, link, from, to } = value;
    if (transaction.docChanged) {
      from = transaction.changes.mapPos(from, 1);
      to = transaction.changes.mapPos(to, 1);
    }
    for (const effect of transaction.effects)
      if (effect.is(setMarked)) {
        ({ spot, link } = effect.value);
        if (spot !== null) ({ from, to } = rangeOf(transaction.state.doc, spot.place));
      }
    return { spot, link, from, to };
  },
});

/** The values of an expression, one for each macro call with a different value. */
export function hintText({ values, more }: Hint): string {
  return [...values, ...(more ? ["\u2026"] : [])].join(" | ");
}

/** The links of the line at an offset. */
export function ownersAt(state: EditorState, offset: number): readonly string[] {
  const line = state.doc.lineAt(offset);
  let names: readonly string[] = [];
  state.field(known).owners.between(line.from, line.to, (at, _, owners) => {
    if (at === line.from) names = owners.names;
  });
  return names;
}

class HintWidget extends WidgetType {
  constructor(private readonly text: string) {
    super();
  }

  override eq(other: HintWidget): boolean {
    return other.text === this.text;
  }

  override toDOM(): HTMLElement {
    return h("span", { class: "value-hint" }, `= ${this.text}`);
  }
}

/** Carets below the text of the selected finding, and its message below them, which stays visible beside a long line. */
class CaretWidget extends WidgetType {
  constructor(
    private readonly finding: Finding,
    private readonly line: string,
    private readonly column: number,
    private readonly length: number,
  ) {
    super();
  }

  override eq(other: CaretWidget): boolean {
    return (
      other.finding === this.finding &&
      other.line === this.line &&
      other.column === this.column &&
      other.length === this.length
    );
  }

  override toDOM(): HTMLElement {
    const before = Array.from(this.line.slice(0, this.column))
      .map((character) => (character === "\t" ? character : " "))
      .join("");
    return h(
      "div",
      { class: "caret", "data-severity": this.finding.severity },
      `${before}${"^".repeat(Math.max(1, this.length))}\n${before}`,
      h("span", { class: "finding-message" }, this.finding.message),
    );
  }
}

const OWNED = Decoration.line({ class: "owned" });

function decorate(state: EditorState): DecorationSet {
  const { doc } = state;
  const { owners, values } = state.field(known);
  const { spot, link, from, to } = state.field(marked);
  const found: Range<Decoration>[] = [];
  if (link !== "")
    owners.between(0, doc.length, (at, _, { names }) => {
      if (names.includes(link) && doc.lineAt(at).from === at) found.push(OWNED.range(at));
    });
  const texts = new Map<number, string[]>();
  values.between(0, doc.length, (at, end, { text }) => {
    if (at < end)
      found.push(Decoration.mark({ attributes: { title: text }, class: "has-value" }).range(at, end));
    const lineEnd = doc.lineAt(at).to;
    texts.set(lineEnd, [...(texts.get(lineEnd) ?? []), text]);
  });
  for (const [at, lineTexts] of texts)
    found.push(
      Decoration.widget({ widget: new HintWidget(lineTexts.join("  \u00b7  ")), side: 1 }).range(at),
    );
  if (spot !== null && spot.place.length > 0) {
    const line = doc.lineAt(from);
    const attributes = { "data-line": String(line.number) };
    found.push(Decoration.line({ class: "here", attributes }).range(line.from));
    if (spot.finding !== null) {
      const widget = new CaretWidget(spot.finding, line.text, from - line.from, to - from);
      found.push(Decoration.widget({ widget, side: 2, block: true }).range(line.to));
    }
  }
  return Decoration.set(found, true);
}

const decorations = StateField.define<DecorationSet>({
  create: decorate,
  update: (value, transaction) =>
    transaction.docChanged ||
    transaction.effects.some((effect) => effect.is(setKnown) || effect.is(setMarked))
      ? decorate(transaction.state)
      : value,
  provide: (field) => EditorView.decorations.from(field),
});

/** Marks the lines of the selected link and the selected place, and shows the values of expressions. */
export const marks: Extension = [known, marked, decorations];
