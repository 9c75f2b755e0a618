/** Changed lines that are looked for between two texts. More are one change, as finding them would take too long. */
const MOST_CHANGED = 1000;

/** A range of lines of the old text, and the range of lines of the new text that replaces it. The ends are exclusive. */
export interface LineChange {
  fromOld: number;
  toOld: number;
  fromNew: number;
  toNew: number;
}

/** The fewest changed lines from one text to another, in order. Source: E. W. Myers, "An O(ND) Difference Algorithm and
 * Its Variations", Algorithmica 1 (1986), the greedy algorithm. */
export function lineChanges(old: readonly string[], now: readonly string[]): LineChange[] {
  const paths = shortestPaths(old, now);
  if (paths === null) return [{ fromOld: 0, toOld: old.length, fromNew: 0, toNew: now.length }];
  const changes: LineChange[] = [];
  let [x, y] = [old.length, now.length];
  for (let count = paths.length - 1; count > 0; count -= 1) {
    const reached = paths[count - 1]!;
    const k = x - y;
    const isInserted = comesFromInsertion(reached, k, count);
    const fromOld = reached.get(isInserted ? k + 1 : k - 1)!;
    const fromNew = fromOld - (isInserted ? k + 1 : k - 1);
    const toOld = isInserted ? fromOld : fromOld + 1;
    const toNew = isInserted ? fromNew + 1 : fromNew;
    const next = changes.at(-1);
    if (next?.fromOld === toOld && next.fromNew === toNew) Object.assign(next, { fromOld, fromNew });
    else changes.push({ fromOld, toOld, fromNew, toNew });
    [x, y] = [fromOld, fromNew];
  }
  return changes.reverse();
}

/** For each number of changes, the most old lines that are covered on each diagonal, which is the number of covered old
 * lines minus that of new lines. Null if there are too many changes. */
function shortestPaths(old: readonly string[], now: readonly string[]): Map<number, number>[] | null {
  const paths: Map<number, number>[] = [];
  for (let count = 0; count <= MOST_CHANGED; count += 1) {
    const before = paths.at(-1);
    const reached = new Map<number, number>();
    paths.push(reached);
    for (let k = -count; k <= count; k += 2) {
      let x = 0;
      if (before !== undefined)
        x = comesFromInsertion(before, k, count) ? before.get(k + 1)! : before.get(k - 1)! + 1;
      while (x < old.length && x - k < now.length && old[x] === now[x - k]) x += 1;
      reached.set(k, x);
      if (x >= old.length && x - k >= now.length) return paths;
    }
  }
  return null;
}

/** Whether the best path to a diagonal ends with an inserted line, not with a deleted one. */
function comesFromInsertion(before: ReadonlyMap<number, number>, k: number, count: number): boolean {
  return k === -count || (k !== count && before.get(k - 1)! < before.get(k + 1)!);
}
