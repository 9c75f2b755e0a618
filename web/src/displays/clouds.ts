import type * as msg from "../messages";
import type { Status } from "./set";

/** Points in the frame of a header, as flat x, y, z, with the intensity and colour of each if known. */
export interface Cloud {
  header: msg.Header;
  places: Float32Array;
  intensity: Float32Array | null;
  /** r, g, b in 0..255. */
  rgb: Uint8Array | null;
}

/** Reads a message, with the field `channel` as intensity. Returns a status if the message is invalid. */
export type ReadCloud = (message: Record<string, unknown>, channel: string) => Cloud | Status;

/** Reads the returned beams of a LaserScan. */
export function readScan(message: Record<string, unknown>): Cloud {
  const scan = message as unknown as msg.LaserScan;
  const { ranges, intensities, range_min, range_max, angle_min, angle_increment } = scan;
  const places = new Float32Array(3 * ranges.length);
  const intensity = new Float32Array(ranges.length);
  let count = 0;
  for (let beam = 0; beam < ranges.length; beam += 1) {
    const range = ranges[beam]!;
    if (!Number.isFinite(range) || range < range_min || range > range_max) continue;
    const angle = angle_min + beam * angle_increment;
    places[3 * count] = range * Math.cos(angle);
    places[3 * count + 1] = range * Math.sin(angle);
    intensity[count] = intensities[beam] ?? 0;
    count += 1;
  }
  return {
    header: scan.header,
    places: places.subarray(0, 3 * count),
    intensity: intensity.subarray(0, count),
    rgb: null,
  };
}

/** Size in bytes of each PointField datatype. */
const SIZES: Record<number, number> = { 1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 8: 8 };
/** Size in bytes of a packed colour. */
const PACKED = 4;

/** Reads a number of each PointField datatype. */
const NUMBERS: Record<number, (view: DataView, at: number, little: boolean) => number> = {
  1: (view, at) => view.getInt8(at),
  2: (view, at) => view.getUint8(at),
  3: (view, at, little) => view.getInt16(at, little),
  4: (view, at, little) => view.getUint16(at, little),
  5: (view, at, little) => view.getInt32(at, little),
  6: (view, at, little) => view.getUint32(at, little),
  7: (view, at, little) => view.getFloat32(at, little),
  8: (view, at, little) => view.getFloat64(at, little),
};

/** Reads a PointCloud2. */
export function readCloud(message: Record<string, unknown>, channel: string): Cloud | Status {
  const cloud = message as unknown as msg.PointCloud2;
  const fieldNamed = (name: string): msg.PointField | undefined =>
    cloud.fields.find((field) => field.name === name);
  const [x, y, z] = ["x", "y", "z"].map(fieldNamed);
  if (x === undefined || y === undefined || z === undefined)
    return { level: "error", reason: "the points have no x, y and z fields" };
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  const value = (field: msg.PointField, base: number): number =>
    NUMBERS[field.datatype]?.(view, base + field.offset, !cloud.is_bigendian) ?? NaN;
  const packed = fieldNamed("rgb") ?? fieldNamed("rgba");
  const shade = fieldNamed(channel || "intensity");
  const most = cloud.height * cloud.width;
  const error = layoutError(cloud, [x, y, z, shade], packed);
  if (error !== null) return { level: "error", reason: error };
  const places = new Float32Array(3 * most);
  const intensity = new Float32Array(shade === undefined ? 0 : most);
  const rgb = new Uint8Array(packed === undefined ? 0 : 3 * most);
  let count = 0;
  for (let row = 0; row < cloud.height; row += 1) {
    for (let column = 0; column < cloud.width; column += 1) {
      const base = row * cloud.row_step + column * cloud.point_step;
      const [px, py, pz] = [value(x, base), value(y, base), value(z, base)];
      if (!Number.isFinite(px + py + pz)) continue;
      places[3 * count] = px;
      places[3 * count + 1] = py;
      places[3 * count + 2] = pz;
      if (shade !== undefined) intensity[count] = value(shade, base);
      if (packed !== undefined) {
        const bits = view.getUint32(base + packed.offset, !cloud.is_bigendian);
        rgb[3 * count] = bits >> 16;
        rgb[3 * count + 1] = bits >> 8;
        rgb[3 * count + 2] = bits;
      }
      count += 1;
    }
  }
  return {
    header: cloud.header,
    places: places.subarray(0, 3 * count),
    intensity: shade === undefined ? null : intensity.subarray(0, count),
    rgb: packed === undefined ? null : rgb.subarray(0, 3 * count),
  };
}

/** What is wrong with the layout of a cloud, null if it is valid. */
function layoutError(
  { height, width, row_step, point_step, data }: msg.PointCloud2,
  numbers: readonly (msg.PointField | undefined)[],
  packed: msg.PointField | undefined,
): string | null {
  if (height * width === 0) return null;
  if (height > 1 && row_step < width * point_step) return "row_step is less than width * point_step";
  if (data.length < (height - 1) * row_step + width * point_step)
    return "data has fewer bytes than its rows need";
  for (const field of numbers) {
    if (field === undefined) continue;
    const size = SIZES[field.datatype];
    if (size === undefined) return `field ${field.name} has the unknown datatype ${field.datatype}`;
    if (field.offset + size > point_step) return `field ${field.name} does not fit into point_step`;
  }
  return packed !== undefined && packed.offset + PACKED > point_step
    ? `field ${packed.name} does not fit into point_step`
    : null;
}
