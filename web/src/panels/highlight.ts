import { h } from "../dom";

// Both run in linear time on any text: a word is tried only from its first letter, and an unclosed token extends to the
// end instead of being tried again.
const TOKENS =
  /(<!--[\s\S]*?(?:-->|$)|<\?[\s\S]*?(?:\?>|$))|(<\/?)([\w:.-]+)|(?<![\w:.-])([\w:.-]+)(?![\w:.-])(?=\s*=)|("[^"]*"?|'[^']*'?)|(\/?>)/g;
const EMBEDDED =
  /\$\{[^}]*(?:\}|$)|\$\([^)]*(?:\)|$)|(?<![\w.$-])-?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?(?![\w.])/gi;

/** A piece of XML text, and the style class of its colour, "" for plain text. */
export type Piece = readonly [text: string, style: string];

/** XML text as lines of coloured elements. */
export function highlight(text: string): (Node | string)[][] {
  return tokenLines(text).map((line) =>
    line.map(([piece, style]) => (style === "" ? piece : h("span", { class: style }, piece))),
  );
}

/** XML text as lines of pieces. */
export function tokenLines(text: string): Piece[][] {
  const lines: Piece[][] = [[]];
  const put = (piece: string, style: string): void => {
    piece.split("\n").forEach((part, index) => {
      if (index > 0) lines.push([]);
      if (part !== "") lines.at(-1)!.push([part, style]);
    });
  };
  let at = 0;
  for (const match of text.matchAll(TOKENS)) {
    put(text.slice(at, match.index), "");
    const [whole, comment, bracket, tag, attribute, value] = match;
    if (comment !== undefined) put(comment, "t-comment");
    else if (tag !== undefined) {
      put(bracket ?? "", "t-mark");
      put(tag, tag.startsWith("xacro:") ? "t-xacro" : "t-tag");
    } else if (attribute !== undefined) put(attribute, "t-name");
    else if (value !== undefined) putValue(value, put);
    else put(whole, "t-mark");
    at = match.index + whole.length;
  }
  put(text.slice(at), "");
  return lines;
}

function putValue(value: string, put: (piece: string, style: string) => void): void {
  let at = 0;
  for (const match of value.matchAll(EMBEDDED)) {
    put(value.slice(at, match.index), "t-value");
    put(match[0], match[0].startsWith("$") ? "t-expression" : "t-number");
    at = match.index + match[0].length;
  }
  put(value.slice(at), "t-value");
}
