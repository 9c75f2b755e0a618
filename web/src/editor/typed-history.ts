import { history } from "@codemirror/commands";
import {
  Compartment,
  StateField,
  Transaction,
  type ChangeDesc,
  type EditorState,
  type Extension,
  type TransactionSpec,
} from "@codemirror/state";

interface Range {
  from: number;
  to: number;
}

/** The ranges of the text that undo and redo may change, in order. */
const typed = StateField.define<readonly Range[]>({
  create: () => [],
  update(ranges, transaction) {
    const { changes } = transaction;
    if (changes.empty) return ranges;
    const now = ranges.map(({ from, to }) => ({ from: changes.mapPos(from, -1), to: changes.mapPos(to, 1) }));
    if (transaction.annotation(Transaction.addToHistory) !== false)
      changes.iterChangedRanges((_from, _to, from, to) => now.push({ from, to }));
    else if (touchesTyped(transaction.startState, changes)) return [];
    return joined(now);
  },
});

function joined(ranges: Range[]): Range[] {
  const all: Range[] = [];
  for (const { from, to } of ranges.sort((one, other) => one.from - other.from)) {
    const last = all.at(-1);
    if (last !== undefined && from <= last.to) last.to = Math.max(last.to, to);
    else all.push({ from, to });
  }
  return all;
}

function touchesTyped(state: EditorState, changes: ChangeDesc): boolean {
  return state.field(typed).some(({ from, to }) => changes.touchesRange(from, to) !== false);
}

const undoable = new Compartment();

/** The undo history of what the user changes. */
export const typedHistory: Extension = [typed, undoable.of(history())];

/** The transactions after a change that is not in the history. If it changed the text that undo would change, the place of
 * that text is lost: undo would put it into the text of the other program. Then the history begins again. */
export function afterChange({ startState, changes }: Transaction): TransactionSpec[] {
  if (!touchesTyped(startState, changes)) return [];
  return [[], history()].map((extension) => ({ effects: undoable.reconfigure(extension) }));
}
