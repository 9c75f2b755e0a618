/** The least height of the plot: absolute, and relative to the values, since the axis has no room for more digits. */
const LEAST = 1e-6;
const LEAST_PART = 5e-5;

/** The range of the plot with a margin. Rounding noise is not enlarged to full height, and an empty plot gets 0 to 1. */
export function paddedRange(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null) return [0, 1];
  if (low === high) return [low - (Math.abs(low) * 0.1 || 0.5), high + (Math.abs(low) * 0.1 || 0.5)];
  const least = Math.max(LEAST, Math.abs(low + high) * LEAST_PART);
  const room = Math.max((high - low) * 0.06, (least - (high - low)) / 2);
  return [low - room, high + room];
}

/** The shortest text of a tick. */
export function tickLabel(tick: number): string {
  const rounded = Number(tick.toFixed(9));
  return rounded !== 0 && Math.abs(rounded) < 1e-4 ? rounded.toExponential() : String(rounded);
}
