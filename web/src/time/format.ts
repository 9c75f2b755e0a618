import { baseName } from "../dom";
import type { Recorded } from "../protocol";

/** A time as `minutes:seconds`, such as `1:02.5` for 62.5 s. */
export function clock(seconds: number): string {
  const tenths = Math.round(Math.max(0, seconds) * 10);
  const rest = (tenths % 600) / 10;
  return `${Math.floor(tenths / 600)}:${rest.toFixed(1).padStart(4, "0")}`;
}

/** A duration for screen readers, such as `12.3 seconds ago`. */
export function ago(seconds: number): string {
  const minutes = Math.floor(seconds / 60);
  const rest = `${(seconds - minutes * 60).toFixed(1)} seconds`;
  return `${minutes > 0 ? `${minutes} ${minutes === 1 ? "minute" : "minutes"} ` : ""}${rest} ago`;
}

export function bytes(count: number): string {
  if (count < 1e6) return `${(count / 1e3).toFixed(0)} kB`;
  return count < 1e9 ? `${(count / 1e6).toFixed(1)} MB` : `${(count / 1e9).toFixed(2)} GB`;
}

export function recordedText({ file }: Recorded): string {
  return `Recorded to ${file}. Play it with: kbot view ${baseName(file)}`;
}
