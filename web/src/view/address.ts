/** A viewpoint in m relative to the origin of `frame`, or of the fixed frame if empty, with the projection and camera mode. */
export interface SavedView {
  eye: number[];
  target: number[];
  orthographic: boolean;
  ride: boolean;
  follow: boolean;
  frame: string;
}

/** Digits of the viewing distance to which positions are written, so that directions are preserved. */
const FINE = 6;

/** A view as the hash of a URL. */
export function viewHash(view: SavedView): string {
  const distance = Math.hypot(...view.eye.map((value, i) => value - view.target[i]!));
  const digits = Math.min(12, Math.max(0, FINE - Math.floor(Math.log10(distance))));
  const text = (numbers: number[]): string => numbers.map((value) => Number(value.toFixed(digits))).join(",");
  return `#eye=${text(view.eye)}&at=${text(view.target)}${view.frame && `&frame=${encodeURIComponent(view.frame)}`}${view.orthographic ? "&flat" : ""}${view.ride ? "&ride" : ""}${view.follow ? "" : "&still"}`;
}

/** The view in the hash of a URL, null if there is no valid one. */
export function readView(hash: string): SavedView | null {
  const values = new URLSearchParams(hash.replace(/^#/, ""));
  const [eye, target] = [triple(values.get("eye")), triple(values.get("at"))];
  if (eye === null || target === null) return null;
  if (Math.hypot(...eye.map((value, i) => value - target[i]!)) < 1e-6) return null;
  return {
    eye,
    target,
    orthographic: values.has("flat"),
    ride: values.has("ride"),
    follow: !values.has("still"),
    frame: values.get("frame") ?? "",
  };
}

function triple(text: string | null): number[] | null {
  const numbers = (text ?? "").split(",").map(Number);
  return numbers.length === 3 &&
    numbers.every((value) => Number.isFinite(value) && Math.abs(value) < 1e6) &&
    text !== ""
    ? numbers
    : null;
}
