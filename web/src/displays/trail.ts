import {
  BufferAttribute,
  BufferGeometry,
  DoubleSide,
  DynamicDrawUsage,
  Mesh,
  MeshBasicMaterial,
} from "three";

import type { State } from "../protocol";
import { PALETTES } from "../view/palette";
import type { Make } from "./display";

/** Limit of stored points. */
const MOST = 8000;

/** A point of the trail: timeline time in s, x and y in m, and whether the robot was moved there instead of driving. */
type Point = readonly [at: number, x: number, y: number, isJump: boolean];

/** Trail: the robot's path, first as sent by the server, then extended by each state. */
export const trail: Make = (picture) => {
  const { app } = picture;
  const ribbon = new Ribbon();
  let resets = -1;
  let jumps = 0;
  /** The time of the newest state here that was live, and the time after which states are missing here. */
  let newest = 0;
  let missing = Infinity;
  let isAwaited = false;
  let colour = "";
  const paint = (): void => void ribbon.mesh.material.color.set(colour || PALETTES[app.theme.value].trail);
  const show = (at: number): void => ribbon.showUntil(app.travel.showsHistory ? at : Infinity);
  /** Requests what is missing, one request at a time: a late page misses states again and again. */
  const ask = (): void => {
    if (isAwaited || missing === Infinity) return;
    app.send({ type: "ask_trail", resets, after: missing });
    isAwaited = true;
    missing = Infinity;
  };
  const follow = (state: State): void => {
    const mode = app.about.value?.mode;
    const played = mode === "play";
    const now = played ? 0 : state.resets; // a recording has one trail for all times
    if (now !== resets) {
      ribbon.clear();
      resets = now;
      newest = state.at;
      missing = -1;
      isAwaited = false;
    }
    const scene = app.scene.value;
    const root = scene?.links.findIndex((link) => link.name === scene.root) ?? -1;
    if (mode !== "view" && root >= 0 && !app.travel.showsHistory) {
      if (state.previous_at > newest) missing = Math.min(missing, newest);
      newest = state.at;
      ribbon.add(state.at, state.poses[root * 7] ?? 0, state.poses[root * 7 + 1] ?? 0, state.jumps !== jumps);
    }
    ask();
    ({ jumps } = state);
    show(state.at);
  };
  const stops = [
    app.connection.link.watch((link) => {
      if (link === "live") resets = -1; // a reconnect may be to another server
    }),
    app.trail.watch((received) => {
      if (received?.resets !== resets) return;
      const put = new Set(received.jumps);
      ribbon.take(
        received.after,
        received.at.map((at, index) => [at, received.x[index]!, received.y[index]!, put.has(index)]),
      );
      isAwaited = false;
      ask();
      show(app.state.value?.at ?? 0);
      picture.invalidate();
    }),
  ];
  return {
    group: ribbon.mesh,
    configure(values) {
      colour = String(values["colour"]);
      paint();
    },
    rebuild(scene) {
      ribbon.fitTo(scene.radius, scene.ground);
      paint();
      if (app.state.value !== null) follow(app.state.value);
    },
    state: follow,
    dispose() {
      for (const stop of stops) stop();
      ribbon.mesh.geometry.dispose();
      ribbon.mesh.material.dispose();
    },
  };
};

/** A ribbon on the floor with gaps where the robot was moved. When it is full, the older half is dropped. */
class Ribbon {
  readonly mesh: Mesh<BufferGeometry, MeshBasicMaterial>;
  private readonly positions = new BufferAttribute(new Float32Array(MOST * 6), 3);
  /** Two triangles from each point to the next. */
  private readonly index = new BufferAttribute(new Uint32Array((MOST - 1) * 6), 1);
  private points: Point[] = [];
  private width = 0.004;
  private spacing = 0.004;

  constructor() {
    this.positions.setUsage(DynamicDrawUsage);
    this.index.setUsage(DynamicDrawUsage);
    for (let i = 1; i < MOST; i += 1) this.join(i, true);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", this.positions);
    geometry.setIndex(this.index);
    geometry.setDrawRange(0, 0);
    this.mesh = new Mesh(
      geometry,
      new MeshBasicMaterial({ side: DoubleSide, transparent: true, opacity: 0.85, depthWrite: false }),
    );
    this.mesh.frustumCulled = false;
  }

  fitTo(radius: number, height: number): void {
    this.width = radius * 0.035;
    this.spacing = radius * 0.03;
    this.mesh.position.z = height + radius * 0.004;
  }

  add(at: number, x: number, y: number, isJump: boolean): void {
    const last = this.points.at(-1);
    if (last !== undefined && Math.hypot(x - last[1], y - last[2]) < this.spacing) return;
    if (this.points.length >= MOST) {
      this.points = this.points.slice(MOST / 2);
      this.points.forEach((_, i) => this.write(i));
    }
    this.points.push([at, x, y, isJump]);
    this.write(this.points.length - 1);
    if (this.points.length > 1) this.write(this.points.length - 2);
    this.positions.needsUpdate = true;
  }

  /** Replaces the trail after a time by the server's. Points added after its end are kept. */
  take(after: number, fromServer: readonly Point[]): void {
    const end = fromServer.at(-1)?.[0] ?? after;
    const before = this.points.filter(([at]) => at <= after);
    this.points = [...before, ...fromServer, ...this.points.filter(([at]) => at > end)].slice(-MOST);
    this.points.forEach((_, i) => this.write(i));
    this.positions.needsUpdate = true;
  }

  /** Draws the trail up to a time. */
  showUntil(at: number): void {
    let [low, high] = [0, this.points.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.points[middle]![0] <= at) low = middle + 1;
      else high = middle;
    }
    this.mesh.geometry.setDrawRange(0, Math.max(0, low - 1) * 6);
  }

  clear(): void {
    this.points = [];
    this.mesh.geometry.setDrawRange(0, 0);
  }

  get length(): number {
    return this.points.length;
  }

  private write(i: number): void {
    const here = this.points[i]!;
    const [, x, y, isJump] = here;
    const next = this.points[i + 1] ?? here;
    const [, fromX, fromY] = isJump ? here : (this.points[i - 1] ?? here);
    const [, toX, toY] = next[3] ? here : next;
    if (i > 0) this.join(i, !isJump);
    const dx = toX - fromX;
    const dy = toY - fromY;
    const scale = this.width / 2 / (Math.hypot(dx, dy) || 1);
    this.positions.setXYZ(2 * i, x - dy * scale, y + dx * scale, 0);
    this.positions.setXYZ(2 * i + 1, x + dy * scale, y - dx * scale, 0);
  }

  /** Joins a point to the previous one, or starts a new piece there. */
  private join(i: number, joined: boolean): void {
    const [from, at] = [2 * (i - 1), (i - 1) * 6];
    const isJoined = this.index.getX(at) !== this.index.getX(at + 1);
    if (joined === isJoined) return;
    this.index.set(
      joined ? [from, from + 1, from + 2, from + 1, from + 3, from + 2] : [0, 0, 0, 0, 0, 0],
      at,
    );
    this.index.needsUpdate = true;
  }
}
