import type { EditorState, Text } from "@codemirror/state";

import type { Place, TextEdit } from "../protocol";

/** The offset of a line and column of the server, which are 1-based and count characters. Clamped to the text. */
export function offsetAt(doc: Text, line: number, column: number): number {
  if (line > doc.lines) return doc.length;
  const row = doc.line(Math.max(1, line));
  let at = 0;
  for (let count = 1; count < column && at < row.length; count += 1)
    at += row.text.codePointAt(at)! > 0xffff ? 2 : 1;
  return row.from + Math.min(at, row.length);
}

/** The column of an offset, as the server counts it. */
export function columnAt(doc: Text, offset: number): number {
  const row = doc.lineAt(offset);
  return Array.from(row.text.slice(0, offset - row.from)).length + 1;
}

/** The offsets of a place. */
export function rangeOf(doc: Text, { line, column, length }: Place): { from: number; to: number } {
  return { from: offsetAt(doc, line, column), to: offsetAt(doc, line, column + length) };
}

/** A change from one text to another: the shortest one that keeps the beginning and the end. */
export function changeTo(
  state: EditorState,
  text: string,
): { from: number; to: number; insert: string } | null {
  const was = state.doc.toString();
  const now = state.toText(text).toString(); // with the line ends that the editor counts as one character
  if (was === now) return null;
  let head = 0;
  const most = Math.min(was.length, now.length);
  while (head < most && was[head] === now[head]) head += 1;
  let tail = 0;
  while (tail < most - head && was.at(-1 - tail) === now.at(-1 - tail)) tail += 1;
  const insert = now.slice(head, now.length - tail);
  return { from: head, to: was.length - tail, insert: insert.replaceAll("\n", state.lineBreak) };
}

/** The edits of a fix as changes of a text. */
export function changesOf(
  doc: Text,
  edits: readonly TextEdit[],
): { from: number; to: number; insert: string }[] {
  return edits.map((edit) => ({
    from: offsetAt(doc, edit.line, edit.column),
    to: offsetAt(doc, edit.end_line, edit.end_column),
    insert: edit.text,
  }));
}

/** The line separator of a text: "\r\n" only if every line ends with it, so that saving changes no other line. */
export function separatorOf(text: string): string {
  return text.includes("\r\n") && !/[^\r]\n|^\n|\r(?!\n)/.test(text) ? "\r\n" : "\n";
}
