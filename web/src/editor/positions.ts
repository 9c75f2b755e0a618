import type { EditorState, Text } from "@codemirror/state";

import type { Place, TextEdit } from "../protocol";
import { lineChanges } from "./line-diff";

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

/** The changes from one text to another: of the fewest lines, each without the equal characters at its ends. Small changes
 * keep the cursor, and leave the undo history what it was at all other places. */
export function changesTo(state: EditorState, text: string): { from: number; to: number; insert: string }[] {
  const old = state.doc.toString();
  const now = state.toText(text).toString(); // with the line ends that the editor counts as one character
  const [oldLines, newLines] = [linesOf(old), linesOf(now)];
  const [oldStarts, newStarts] = [startsOf(oldLines), startsOf(newLines)];
  return lineChanges(oldLines, newLines).map(({ fromOld, toOld, fromNew, toNew }) => {
    const start = oldStarts[fromOld]!;
    const was = old.slice(start, oldStarts[toOld]);
    const put = now.slice(newStarts[fromNew], newStarts[toNew]);
    let head = 0;
    const most = Math.min(was.length, put.length);
    while (head < most && was[head] === put[head]) head += 1;
    let tail = 0;
    while (tail < most - head && was.at(-1 - tail) === put.at(-1 - tail)) tail += 1;
    const insert = put.slice(head, put.length - tail).replaceAll("\n", state.lineBreak);
    return { from: start + head, to: start + was.length - tail, insert };
  });
}

/** The lines of a text with their line ends. */
function linesOf(text: string): string[] {
  return text.match(/[^\n]*\n|[^\n]+/g) ?? [];
}

/** The offset of each line, and of the end. */
function startsOf(lines: readonly string[]): number[] {
  const starts = [0];
  for (const line of lines) starts.push(starts.at(-1)! + line.length);
  return starts;
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
