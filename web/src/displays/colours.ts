import { Color } from "three";

/** Colour stops of viridis, which is readable with colour blindness: https://bids.github.io/colormap */
const VIRIDIS = [
  [0.267, 0.005, 0.329],
  [0.231, 0.322, 0.545],
  [0.129, 0.569, 0.549],
  [0.369, 0.788, 0.383],
  [0.993, 0.906, 0.144],
] as const;

/** The viridis colour of a value between 0 and 1. */
export function viridis(value: number): [number, number, number] {
  const at = Math.min(1, Math.max(0, value)) * (VIRIDIS.length - 1);
  const low = VIRIDIS[Math.floor(at)]!;
  const high = VIRIDIS[Math.min(VIRIDIS.length - 1, Math.floor(at) + 1)]!;
  const part = at - Math.floor(at);
  return [0, 1, 2].map((i) => low[i]! + (high[i]! - low[i]!) * part) as [number, number, number];
}

const STEPS = 256;
let table: Float32Array | null = null;

/** Viridis colours (r, g, b, linear) of values between `low` and `high`. */
export function shades(values: ArrayLike<number>, low: number, high: number): Float32Array {
  const colourTable = (table ??= linearTable((step) => viridis(step / (STEPS - 1))));
  const colours = new Float32Array(3 * values.length);
  const scale = (STEPS - 1) / (high - low || 1);
  for (let i = 0; i < values.length; i += 1) {
    const step = Math.min(STEPS - 1, Math.max(0, Math.round((values[i]! - low) * scale))) || 0;
    for (let part = 0; part < 3; part += 1) colours[3 * i + part] = colourTable[3 * step + part]!;
  }
  return colours;
}

/** Converts sRGB colours (0..255) to linear space. */
export function linear(colours: Uint8Array): Float32Array {
  const light = linearTable((step) => [step / 255, step / 255, step / 255]);
  return Float32Array.from(colours, (part) => light[3 * part]!);
}

function linearTable(colour: (step: number) => readonly [number, number, number]): Float32Array {
  const mixed = new Color();
  const colours = new Float32Array(3 * STEPS);
  for (let step = 0; step < STEPS; step += 1)
    mixed.setRGB(...colour(step), "srgb").toArray(colours, 3 * step);
  return colours;
}
