import { Color, Group, Mesh, MeshLambertMaterial, type BufferGeometry, type Object3D } from "three";

import type * as msg from "../messages";
import type { State, TopicMessage } from "../protocol";
import type { Display, Make, Picture } from "./display";
import { placeAtHeader, seconds } from "./frames";
import { GAPS, hasGaps } from "./gaps";
import { BUILDERS } from "./marker-objects";
import { poseMatrix } from "./pose-shapes";
import type { Status, Values } from "./set";

const DELETE = 2;
const DELETE_ALL = 3;

interface Drawn {
  marker: msg.Marker;
  /** Placed at the frame of the header. Its child is placed at the marker's pose. */
  holder: Group;
  until: number;
}

/** Marker and MarkerArray, by namespace and id. */
class Markers implements Display {
  readonly group = new Group();
  readonly takesGaps = true; // each marker is checked by itself, so that an invalid one does not hide the others
  protected readonly drawn = new Map<string, Drawn>();
  /** All namespaces received. */
  private readonly knownNamespaces = new Set<string>();
  private set: Values = {};
  private resets = 0;

  constructor(protected readonly picture: Picture) {}

  configure(values: Values): void {
    this.set = values;
    for (const { holder, marker } of this.drawn.values()) holder.visible = this.isWanted(marker);
  }

  message({ message }: TopicMessage): Status | null {
    const all = (message as { markers?: msg.Marker[] }).markers ?? [message as unknown as msg.Marker];
    let problem: Status | null = null;
    for (const marker of all) problem = this.take(marker) ?? problem;
    return problem;
  }

  state(state: State): void {
    if (state.resets !== this.resets) this.clear();
    this.resets = state.resets;
    const over = [...this.drawn].filter(([, { until }]) => state.time > until);
    for (const [key] of over) this.drop(key);
    if (over.length > 0) this.picture.invalidate();
  }

  frame(): void {
    for (const { marker, holder } of this.drawn.values())
      if (marker.frame_locked) this.put(holder, marker, true);
  }

  get namespaces(): readonly string[] {
    return [...this.knownNamespaces].sort();
  }

  clear(): void {
    for (const key of [...this.drawn.keys()]) this.drop(key);
    this.knownNamespaces.clear();
  }

  dispose(): void {
    this.clear();
  }

  /** Adapts a marker before it is drawn. */
  protected prepared(marker: msg.Marker): msg.Marker {
    return marker;
  }

  private take(received: msg.Marker): Status | null {
    const key = `${received.ns}\n${received.id}`;
    if (received.action === DELETE_ALL) {
      for (const [name, { marker }] of this.drawn)
        if (received.ns === "" || marker.ns === received.ns) this.drop(name);
      return null;
    }
    this.drop(key);
    if (received.action === DELETE) return null;
    this.knownNamespaces.add(received.ns);
    const marker = this.prepared(received);
    const build = BUILDERS[marker.type];
    if (build === undefined)
      return { level: "error", reason: `${named(marker)} has the unknown type ${marker.type}` };
    if (hasGaps(marker)) return { level: "error", reason: `${named(marker)} contains ${GAPS}` };
    const holder = new Group();
    const object = new Group();
    object.matrixAutoUpdate = false;
    poseMatrix(marker.pose, object.matrix);
    object.add(build(marker, () => this.picture.invalidate()));
    holder.add(object);
    this.group.add(holder);
    const life = seconds(marker.lifetime);
    this.drawn.set(key, { marker, holder, until: life > 0 ? seconds(marker.header.stamp) + life : Infinity });
    return this.put(holder, marker, marker.frame_locked) ?? visibilityWarning(marker);
  }

  private put(holder: Group, marker: msg.Marker, isNow: boolean): Status | null {
    const now = this.picture.app.state.value?.time ?? 0;
    const stamp = isNow
      ? { sec: Math.floor(now), nanosec: Math.round((now % 1) * 1e9) }
      : marker.header.stamp;
    const status = placeAtHeader(this.picture, holder, { ...marker.header, stamp });
    holder.visible = status === null && this.isWanted(marker);
    return status;
  }

  private isWanted({ ns }: msg.Marker): boolean {
    return this.set[`${ns}/show`] !== false;
  }

  private drop(key: string): void {
    const entry = this.drawn.get(key);
    if (entry === undefined) return;
    this.drawn.delete(key);
    entry.holder.removeFromParent();
    entry.holder.traverse(free);
  }
}

function named({ ns, id }: msg.Marker): string {
  return `marker ${ns === "" ? "" : `${ns}/`}${id}`;
}

/** Warnings about invisible markers, as in rviz. */
function visibilityWarning(marker: msg.Marker): Status | null {
  if (marker.colors.length === 0 && marker.color.a === 0 && !marker.mesh_use_embedded_materials)
    return { level: "warn", reason: `${named(marker)} is invisible: color.a is 0` };
  if (marker.type === 10 && marker.mesh_resource === "")
    return { level: "warn", reason: `the mesh of ${named(marker)} cannot be read` };
  return null;
}

function free(object: Object3D): void {
  const { geometry, material } = object as Partial<Mesh<BufferGeometry, MeshLambertMaterial>>;
  if (object.userData["shared"] !== true) geometry?.dispose();
  material?.map?.dispose();
  material?.dispose();
}

/** Contacts: forces as arrows. The server scales them so that the robot's weight is one radius of the robot long. */
class Contacts extends Markers {
  private values: Values = {};

  override configure(values: Values): void {
    this.values = values;
  }

  override prepared(marker: msg.Marker): msg.Marker {
    const [from, to] = marker.points;
    if (from === undefined || to === undefined) return marker;
    const wide = this.picture.radius * 0.06;
    const factor = (Number(this.values["scale"]) || this.picture.radius) / this.picture.radius;
    const tip = (start: number, end: number): number => start + (end - start) * factor;
    const { r, g, b } = new Color(String(this.values["colour"])).convertLinearToSRGB();
    return {
      ...marker,
      points: [from, { x: tip(from.x, to.x), y: tip(from.y, to.y), z: tip(from.z, to.z) }],
      scale: { x: wide, y: wide * 2.4, z: wide * 3 },
      color: { r, g, b, a: 1 },
    };
  }
}

export const markers: Make = (picture) => new Markers(picture);
export const contacts: Make = (picture) => new Contacts(picture);
