/** Where one looks from and at, in metres from the origin of a frame or the fixed one, and how: without perspective, as the robot sees, along with that frame. */
export interface SavedView {
  eye: number[];
  target: number[];
  orthographic: boolean;
  ride: boolean;
  follow: boolean;
  frame: string;
}

/** Decimal digits of the distance to which places are written, so that directions come out the same. */
const FINE = 6;

/** A view as the part of an address after the hash. */
export function viewHash(view: SavedView): string {
  const distance = Math.hypot(...view.eye.map((value, i) => value - view.target[i]!));
  const digits = Math.min(12, Math.max(0, FINE - Math.floor(Math.log10(distance))));
  const text = (numbers: number[]): string => numbers.map((value) => Number(value.toFixed(digits))).join(",");
  return `#eye=${text(view.eye)}&at=${text(view.target)}${view.frame && `&frame=${encodeURIComponent(view.frame)}`}${view.orthographic ? "&flat" : ""}${view.ride ? "&ride" : ""}${view.follow ? "" : "&still"}`;
}

/** The view that an address has, null when it has none that can be used. */
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
