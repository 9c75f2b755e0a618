/** A rectangle on the screen in pixels, y down. */
export interface Rect {
  left: number;
  top: number;
  width: number;
  height: number;
}

/** The largest number of its own heights by which a label moves. */
const MOST = 24;

/** The number of its own heights by which a label must move up so that it covers none of the others. */
export function stepsUp(label: Rect, others: readonly Rect[]): number {
  for (let steps = 0; steps < MOST; steps += 1) {
    const moved = { ...label, top: label.top - steps * label.height };
    if (!others.some((other) => overlap(moved, other))) return steps;
  }
  return 0; // there is no free place near it
}

function overlap(a: Rect, b: Rect): boolean {
  return (
    a.left < b.left + b.width &&
    b.left < a.left + a.width &&
    a.top < b.top + b.height &&
    b.top < a.top + a.height
  );
}
