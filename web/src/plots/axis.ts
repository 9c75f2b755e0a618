/** The least that is told apart up the plot: in the number's unit, and as a part of the number, which the axis has room to tell. */
const LEAST = 1e-6;
const LEAST_PART = 5e-5;

/** A range with some room, also where nothing changes but by rounding, or nothing is known. */
export function paddedRange(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null) return [0, 1];
  if (low === high) return [low - (Math.abs(low) * 0.1 || 0.5), high + (Math.abs(low) * 0.1 || 0.5)];
  const least = Math.max(LEAST, Math.abs(low + high) * LEAST_PART);
  const room = Math.max((high - low) * 0.06, (least - (high - low)) / 2);
  return [low - room, high + room];
}

/** A number at the axis, in as few signs as tell it. */
export function tickLabel(tick: number): string {
  const rounded = Number(tick.toFixed(9));
  return rounded !== 0 && Math.abs(rounded) < 1e-4 ? rounded.toExponential() : String(rounded);
}
