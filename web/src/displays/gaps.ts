/** Whether a message contains a null, which JSON uses for NaN and infinity. Typed arrays may hold both and are skipped. */
export function hasGaps(value: unknown): boolean {
  if (value === null) return true;
  if (typeof value !== "object" || ArrayBuffer.isView(value)) return false;
  return Object.values(value).some(hasGaps);
}

export const GAPS = "numbers that are NaN or infinite";
