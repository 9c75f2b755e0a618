import { Group, Matrix4, Vector3 } from "three";

import type { TopicMessage } from "../protocol";
import { Beams } from "./beams";
import { readCloud, readScan, type Cloud, type ReadCloud } from "./clouds";
import { linear, shades } from "./colours";
import type { Display, Make, Picture } from "./display";
import { placeAtHeader, seconds } from "./frames";
import { PointShapes, type Drawn } from "./point-shapes";
import type { Status, Values } from "./set";

interface Shown {
  cloud: Cloud;
  time: number;
  drawn: Drawn;
}

/** LaserScan and PointCloud2. Points stay where they were measured until they decay. */
class PointsDisplay implements Display {
  readonly group = new Group();
  private readonly shapes = new PointShapes();
  private shown: Shown[] = [];
  private values: Values = {};

  constructor(
    private readonly picture: Picture,
    private readonly read: ReadCloud,
    private readonly beams: Beams | null = null,
  ) {
    if (beams !== null) this.group.add(beams.lines);
  }

  configure(values: Values): void {
    this.values = values;
    this.beams?.set(values);
    this.shapes.set(values, values["by"] === "colour" ? String(values["colour"]) : null);
    for (const entry of this.shown) {
      const { matrix, visible } = entry.drawn;
      this.shapes.drop(entry.drawn);
      entry.drawn = this.draw(entry.cloud, matrix);
      entry.drawn.visible = visible;
    }
  }

  message({ message }: TopicMessage): Status | null {
    const cloud = this.read(message, String(this.values["channel"] ?? ""));
    if ("level" in cloud) return cloud;
    const time = seconds(cloud.header.stamp);
    const decay = this.values["decay"] as number;
    const isOld = (entry: Shown): boolean => time - entry.time >= decay || time < entry.time;
    for (const { drawn } of this.shown.filter(isOld)) this.shapes.drop(drawn);
    this.shown = this.shown.filter((entry) => !isOld(entry));
    const place = new Group();
    const status = placeAtHeader(this.picture, place, cloud.header);
    this.beams?.show(cloud.places, place);
    const drawn = this.draw(cloud, place.matrix);
    drawn.visible = place.visible;
    this.shown.push({ cloud, time, drawn });
    return status ?? this.missingField(cloud);
  }

  clear(): void {
    this.beams?.clear();
    for (const { drawn } of this.shown) this.shapes.drop(drawn);
    this.shown = [];
  }

  dispose(): void {
    this.clear();
    this.shapes.dispose();
    this.beams?.dispose();
  }

  private draw(cloud: Cloud, matrix: Matrix4): Drawn {
    const drawn = this.shapes.make(cloud.places, this.colours(cloud, matrix));
    drawn.matrixAutoUpdate = false;
    drawn.matrix.copy(matrix);
    drawn.matrixWorldNeedsUpdate = true;
    this.group.add(drawn);
    return drawn;
  }

  /** A warning if the points lack the field they are coloured by. */
  private missingField({ intensity, rgb }: Cloud): Status | null {
    const { by, channel } = this.values;
    if (by === "intensity" && intensity === null)
      return { level: "warn", reason: `the points have no ${String(channel) || "intensity"} field` };
    return by === "rgb" && rgb === null
      ? { level: "warn", reason: "the points have no rgb field and are coloured by z" }
      : null;
  }

  /** The colour of each point in linear space, null if all have the colour of the settings. */
  private colours(cloud: Cloud, matrix: Matrix4): Float32Array | null {
    const { by, auto } = this.values;
    if (by === "colour") return null;
    if (by === "rgb" && cloud.rgb !== null) return linear(cloud.rgb);
    const values = this.scalars(cloud, matrix);
    if (auto !== true) return shades(values, Number(this.values["low"]), Number(this.values["high"]));
    let [low, high] = [Infinity, -Infinity];
    for (const value of values) {
      if (!Number.isFinite(value)) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
    return shades(values, low, high);
  }

  /** The values that determine the colours. */
  private scalars({ places, intensity }: Cloud, matrix: Matrix4): Float32Array {
    const by = this.values["by"];
    const count = places.length / 3;
    if (by === "intensity") return intensity ?? new Float32Array(count);
    const result = new Float32Array(count);
    const at = new Vector3();
    for (let i = 0; i < count; i += 1) {
      at.fromArray(places, 3 * i);
      if (by !== "distance") at.applyMatrix4(matrix);
      result[i] = by === "distance" ? at.length() : by === "x" ? at.x : by === "y" ? at.y : at.z;
    }
    return result;
  }
}

export const laserScan: Make = (picture) => new PointsDisplay(picture, readScan, new Beams());
export const pointCloud: Make = (picture) => new PointsDisplay(picture, readCloud);
