import { BufferGeometry, Color, Float32BufferAttribute, Group, Matrix4, Points, PointsMaterial, Vector3 } from "three";

import type * as msg from "../messages";
import type { TopicMessage } from "../protocol";
import { viridis } from "./colours";
import type { Display, Make, Picture } from "./display";
import { placeAtHeader, seconds } from "./frames";
import type { Status, Values } from "./set";

/** Points in the frame of a header, x, y, z one after the other, and what else is known of each. */
interface Cloud {
  header: msg.Header;
  places: number[] | Float32Array;
  intensity: ArrayLike<number> | null;
  /** r, g, b in 0..1. */
  rgb: number[] | null;
}

interface Shown {
  points: Points<BufferGeometry, PointsMaterial>;
  time: number;
}

/** Points that stay where they were seen, the older ones for a while. */
class PointsDisplay implements Display {
  readonly group = new Group();
  private readonly material = new PointsMaterial({ sizeAttenuation: false, toneMapped: false, transparent: true });
  private shown: Shown[] = [];
  private values: Values = {};
  private last: Cloud | null = null;

  constructor(
    private readonly picture: Picture,
    private readonly read: (message: Record<string, unknown>) => Cloud | Status,
  ) {}

  configure(values: Values): void {
    const recoloured = values["by"] !== this.values["by"];
    this.values = values;
    const isFlat = values["by"] === "colour";
    this.material.color = isFlat ? new Color(values["colour"] as string) : new Color(0xffffff);
    this.material.size = values["size"] as number;
    this.material.opacity = values["alpha"] as number;
    this.material.vertexColors = !isFlat;
    this.material.needsUpdate = true;
    if (recoloured && this.last !== null) this.show(this.last);
  }

  message({ message }: TopicMessage): Status | null {
    const cloud = this.read(message);
    if ("level" in cloud) return cloud;
    this.last = cloud;
    return this.show(cloud);
  }

  clear(): void {
    for (const one of this.shown) this.drop(one);
    this.shown = [];
    this.last = null;
  }

  dispose(): void {
    this.clear();
    this.material.dispose();
  }

  private show(cloud: Cloud): Status | null {
    const time = seconds(cloud.header.stamp);
    const decay = this.values["decay"] as number;
    const isOld = (one: Shown): boolean => time - one.time >= decay || time < one.time;
    for (const one of this.shown) if (isOld(one)) this.drop(one);
    this.shown = this.shown.filter((one) => !isOld(one));
    const points = new Points(new BufferGeometry(), this.material);
    points.frustumCulled = false;
    points.geometry.setAttribute("position", new Float32BufferAttribute(cloud.places, 3));
    const status = placeAtHeader(this.picture, points, cloud.header);
    const colours = this.colours(cloud, points.matrix);
    if (colours !== null) points.geometry.setAttribute("color", new Float32BufferAttribute(colours, 3));
    this.group.add(points);
    this.shown.push({ points, time });
    return status;
  }

  private drop({ points }: Shown): void {
    points.removeFromParent();
    points.geometry.dispose();
  }

  /** Colours in the picture's linear space; null for the one that is set. */
  private colours(cloud: Cloud, matrix: Matrix4): number[] | null {
    const by = this.values["by"];
    if (by === "colour") return null;
    const linear = new Color();
    if (by === "rgb" && cloud.rgb !== null) {
      const { rgb } = cloud;
      return Array.from({ length: rgb.length / 3 }, (_, i) => linear.setRGB(rgb[3 * i]!, rgb[3 * i + 1]!, rgb[3 * i + 2]!, "srgb").toArray()).flat();
    }
    const values = this.scalars(cloud, matrix);
    let [low, high] = [Infinity, -Infinity];
    for (const value of values) {
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
    const span = high - low || 1;
    return values.flatMap((value) => linear.setRGB(...viridis((value - low) / span), "srgb").toArray());
  }

  /** What the points are coloured by. */
  private scalars({ places, intensity }: Cloud, matrix: Matrix4): number[] {
    const by = this.values["by"];
    const count = places.length / 3;
    if (by === "intensity") return Array.from({ length: count }, (_, i) => intensity?.[i] ?? 0);
    const at = new Vector3();
    return Array.from({ length: count }, (_, i) => {
      at.fromArray(places as number[], 3 * i);
      if (by === "distance") return at.length();
      at.applyMatrix4(matrix);
      return by === "x" ? at.x : by === "y" ? at.y : at.z;
    });
  }
}

/** The beams that came back. */
function readScan(message: Record<string, unknown>): Cloud {
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
  return { header: scan.header, places: places.subarray(0, 3 * count), intensity: intensity.subarray(0, count), rgb: null };
}

/** Readers of the numbers that a PointField may hold, by its datatype. */
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

function readCloud(message: Record<string, unknown>): Cloud | Status {
  const cloud = message as unknown as msg.PointCloud2;
  const field = (name: string): msg.PointField | undefined => cloud.fields.find((one) => one.name === name);
  const [x, y, z] = ["x", "y", "z"].map(field);
  if (x === undefined || y === undefined || z === undefined) return { level: "error", reason: "its points have no x, y and z" };
  if (cloud.data.length < cloud.row_step * cloud.height) return { level: "error", reason: "it has fewer bytes than its rows need" };
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  const value = (one: msg.PointField, base: number): number => NUMBERS[one.datatype]?.(view, base + one.offset, !cloud.is_bigendian) ?? NaN;
  const packed = field("rgb") ?? field("rgba");
  const shade = field("intensity");
  const places: number[] = [];
  const intensity: number[] = [];
  const rgb: number[] = [];
  for (let row = 0; row < cloud.height; row += 1) {
    for (let column = 0; column < cloud.width; column += 1) {
      const base = row * cloud.row_step + column * cloud.point_step;
      const place = [value(x, base), value(y, base), value(z, base)];
      if (!place.every(Number.isFinite)) continue;
      places.push(...place);
      if (shade !== undefined) intensity.push(value(shade, base));
      if (packed === undefined) continue;
      const bits = view.getUint32(base + packed.offset, !cloud.is_bigendian);
      rgb.push(((bits >> 16) & 255) / 255, ((bits >> 8) & 255) / 255, (bits & 255) / 255);
    }
  }
  return { header: cloud.header, places, intensity: shade === undefined ? null : intensity, rgb: packed === undefined ? null : rgb };
}

export const laserScan: Make = (picture) => new PointsDisplay(picture, readScan);
export const pointCloud: Make = (picture) => new PointsDisplay(picture, readCloud);
