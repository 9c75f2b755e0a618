/** Whether a message, or a part of it, holds what is no number: JSON has null for nan and infinity. Arrays of numbers alone may. */
export function hasGaps(value: unknown): boolean {
  if (value === null) return true;
  if (typeof value !== "object" || ArrayBuffer.isView(value)) return false;
  return Object.values(value).some(hasGaps);
}

export const GAPS = "numbers that are nan or infinite";
