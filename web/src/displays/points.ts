import { Color, Group, Matrix4, Vector3 } from "three";

import type { TopicMessage } from "../protocol";
import { readCloud, readScan, type Cloud, type ReadCloud } from "./clouds";
import { viridis } from "./colours";
import type { Display, Make, Picture } from "./display";
import { placeAtHeader, seconds } from "./frames";
import { PointShapes, type Drawn } from "./point-shapes";
import type { Status, Values } from "./set";

interface Shown {
  cloud: Cloud;
  time: number;
  drawn: Drawn;
}

/** Points that stay where they were seen, the older ones for a while. */
class PointsDisplay implements Display {
  readonly group = new Group();
  private readonly shapes = new PointShapes();
  private shown: Shown[] = [];
  private values: Values = {};

  constructor(
    private readonly picture: Picture,
    private readonly read: ReadCloud,
  ) {}

  configure(values: Values): void {
    this.values = values;
    this.shapes.set(values, values["by"] === "colour" ? String(values["colour"]) : null);
    for (const one of this.shown) {
      const { matrix, visible } = one.drawn;
      this.shapes.drop(one.drawn);
      one.drawn = this.draw(one.cloud, matrix);
      one.drawn.visible = visible;
    }
  }

  message({ message }: TopicMessage): Status | null {
    const cloud = this.read(message, String(this.values["channel"] ?? ""));
    if ("level" in cloud) return cloud;
    const time = seconds(cloud.header.stamp);
    const decay = this.values["decay"] as number;
    const isOld = (one: Shown): boolean => time - one.time >= decay || time < one.time;
    for (const { drawn } of this.shown.filter(isOld)) this.shapes.drop(drawn);
    this.shown = this.shown.filter((one) => !isOld(one));
    const place = new Group();
    const status = placeAtHeader(this.picture, place, cloud.header);
    const drawn = this.draw(cloud, place.matrix);
    drawn.visible = place.visible;
    this.shown.push({ cloud, time, drawn });
    return status ?? this.doubt(cloud);
  }

  clear(): void {
    for (const { drawn } of this.shown) this.shapes.drop(drawn);
    this.shown = [];
  }

  dispose(): void {
    this.clear();
    this.shapes.dispose();
  }

  private draw(cloud: Cloud, matrix: Matrix4): Drawn {
    const drawn = this.shapes.make(cloud.places, this.colours(cloud, matrix));
    drawn.matrixAutoUpdate = false;
    drawn.matrix.copy(matrix);
    drawn.matrixWorldNeedsUpdate = true;
    this.group.add(drawn);
    return drawn;
  }

  /** What the points are to be coloured by and do not have. */
  private doubt({ intensity, rgb }: Cloud): Status | null {
    const { by, channel } = this.values;
    if (by === "intensity" && intensity === null) return { level: "warn", reason: `its points have no ${String(channel) || "intensity"}` };
    return by === "rgb" && rgb === null ? { level: "warn", reason: "its points have no rgb: they are coloured by z" } : null;
  }

  /** Colours in the picture's linear space; null for the one that is set. */
  private colours(cloud: Cloud, matrix: Matrix4): number[] | null {
    const { by, auto } = this.values;
    if (by === "colour") return null;
    const linear = new Color();
    if (by === "rgb" && cloud.rgb !== null) {
      const { rgb } = cloud;
      return Array.from({ length: rgb.length / 3 }, (_, i) => linear.setRGB(rgb[3 * i]!, rgb[3 * i + 1]!, rgb[3 * i + 2]!, "srgb").toArray()).flat();
    }
    const values = this.scalars(cloud, matrix);
    let [low, high] = auto === true ? [Infinity, -Infinity] : [Number(this.values["low"]), Number(this.values["high"])];
    for (const value of auto === true ? values : []) {
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

export const laserScan: Make = (picture) => new PointsDisplay(picture, readScan);
export const pointCloud: Make = (picture) => new PointsDisplay(picture, readCloud);
