import { syntaxTree } from "@codemirror/language";
import { RangeSetBuilder, type Text } from "@codemirror/state";
import {
  Decoration,
  ViewPlugin,
  type DecorationSet,
  type EditorView,
  type ViewUpdate,
} from "@codemirror/view";
import type { Tree } from "@lezer/common";

/** An expression or a number in an attribute's value. An unclosed expression extends to the end. */
const EMBEDDED =
  /\$\{[^}]*(?:\}|$)|\$\([^)]*(?:\)|$)|(?<![\w.$-])-?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?(?![\w.])/gi;

const STYLES: Readonly<Record<string, string>> = {
  AttributeName: "t-name",
  Comment: "t-comment",
  ProcessingInst: "t-comment",
  DoctypeDecl: "t-comment",
  StartTag: "t-mark",
  StartCloseTag: "t-mark",
  EndTag: "t-mark",
  SelfCloseEndTag: "t-mark",
};

/** A piece of a text, and the style class of its colour. */
export interface Piece {
  from: number;
  to: number;
  style: string;
}

/** The coloured pieces of XML text between two offsets, in order. */
export function piecesOf(tree: Tree, doc: Text, from: number, to: number): Piece[] {
  const pieces: Piece[] = [];
  tree.iterate({
    from,
    to,
    enter: ({ name, from, to }) => {
      if (name === "TagName")
        pieces.push({
          from,
          to,
          style: doc.sliceString(from, to).startsWith("xacro:") ? "t-xacro" : "t-tag",
        });
      else if (name === "AttributeValue") putValue(doc.sliceString(from, to), from, pieces);
      else if (STYLES[name] !== undefined) pieces.push({ from, to, style: STYLES[name] });
    },
  });
  return pieces;
}

function putValue(value: string, start: number, pieces: Piece[]): void {
  let at = 0;
  const put = (from: number, to: number, style: string): void => {
    if (from < to) pieces.push({ from: start + from, to: start + to, style });
  };
  for (const match of value.matchAll(EMBEDDED)) {
    const end = match.index + match[0].length;
    put(at, match.index, "t-value");
    put(match.index, end, match[0].startsWith("$") ? "t-expression" : "t-number");
    at = end;
  }
  put(at, value.length, "t-value");
}

/** Colours the visible text. */
export const colours = ViewPlugin.fromClass(
  class {
    decorations: DecorationSet;

    constructor(view: EditorView) {
      this.decorations = decorate(view);
    }

    update(update: ViewUpdate): void {
      if (
        update.docChanged ||
        update.viewportChanged ||
        syntaxTree(update.startState) !== syntaxTree(update.state)
      )
        this.decorations = decorate(update.view);
    }
  },
  { decorations: (plugin) => plugin.decorations },
);

const MARKS = new Map<string, Decoration>();

function markOf(style: string): Decoration {
  const mark = MARKS.get(style) ?? Decoration.mark({ class: style });
  MARKS.set(style, mark);
  return mark;
}

function decorate(view: EditorView): DecorationSet {
  const builder = new RangeSetBuilder<Decoration>();
  const tree = syntaxTree(view.state);
  for (const { from, to } of view.visibleRanges)
    for (const piece of piecesOf(tree, view.state.doc, from, to))
      builder.add(piece.from, piece.to, markOf(piece.style));
  return builder.finish();
}
