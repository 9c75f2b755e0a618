import {
  BufferGeometry,
  CanvasTexture,
  Color,
  CylinderGeometry,
  Float32BufferAttribute,
  Group,
  InstancedMesh,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  MeshBasicMaterial,
  Sprite,
  SpriteMaterial,
  Vector3,
} from "three";

import type { Theme } from "../options";
import { AXES } from "../view/palette";
import { stepsUp, type Rect } from "./declutter";
import type { Display, Make, Picture } from "./display";
import type { Values } from "./set";

/** Height of a label in CSS pixels. */
const LABEL_PIXELS = 22;
/** The point of a label that is at its frame, as a part of its width and height: the frame is below its left end. */
const [ANCHOR_X, ANCHOR_Y] = [-0.06, -0.25];
const ARROWS = 0xe86fc5;
const COLOURS = [AXES.x, AXES.y, AXES.z].map((colour) => new Color(colour));

/** Sides of a rod. A rod is a few pixels thick, and one with ten sides takes a fifth of a frame's time in software rendering. */
const SIDES = 6;

/** TF: axes and names of frames, scaled to the robot. Those of the selected link are always shown. */
class Frames implements Display {
  readonly group = new Group();
  /** Three instances for each frame: its x, y and z axis. */
  private axes: InstancedMesh<CylinderGeometry, MeshBasicMaterial> | null = null;
  private still: Matrix4[] = [];
  private readonly labels = new Map<string, Sprite>();
  private values: Values = {};
  private selected = "";
  private readonly arrows = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ color: ARROWS, depthTest: false, transparent: true, toneMapped: false }),
  );

  constructor(private readonly picture: Picture) {
    this.arrows.frustumCulled = false;
    this.arrows.renderOrder = 7;
  }

  configure(values: Values): void {
    const resized = values["length"] !== this.values["length"];
    this.values = values;
    if (resized && this.axes !== null) this.rebuild();
  }

  private get length(): number {
    return Number(this.values["length"]) || this.picture.radius * 0.42;
  }

  select(link: string): void {
    this.selected = link;
  }

  rebuild(): void {
    this.free();
    this.group.clear();
    this.labels.clear();
    const length = this.length;
    const rod = new CylinderGeometry(length * 0.022, length * 0.022, length, SIDES);
    this.axes = axesMesh(rod, this.picture.transforms.names.length + SPARE);
    this.still = [
      new Matrix4().makeRotationZ(-Math.PI / 2).setPosition(length / 2, 0, 0),
      new Matrix4().setPosition(0, length / 2, 0),
      new Matrix4().makeRotationX(Math.PI / 2).setPosition(0, 0, length / 2),
    ];
    this.group.add(this.axes, this.arrows);
  }

  frame(): void {
    const mesh = this.axes;
    if (mesh === null) return;
    const { transforms, perPixel } = this.picture;
    const { axes, names } = this.values;
    const passes = this.nameFilter();
    const taken: Rect[] = [];
    const product = new Matrix4();
    const at = new Matrix4();
    const named = new Set<string>();
    let count = 0;
    for (const name of transforms.names) {
      const isSelected = name === this.selected;
      const isIncluded = passes(name);
      const hasAxes = isSelected || (axes === true && isIncluded);
      const hasName = isSelected || (names === true && isIncluded);
      if (!(hasAxes || hasName) || transforms.lookup(name, null, at) === null) continue;
      if (hasName) {
        named.add(name);
        this.putLabel(name, at, LABEL_PIXELS * perPixel, taken);
      }
      if (!hasAxes || count >= mesh.instanceMatrix.count) continue;
      for (const still of this.still) mesh.setMatrixAt(count++, product.multiplyMatrices(at, still));
    }
    this.putArrows(passes);
    for (const [name, sprite] of this.labels) sprite.visible = named.has(name);
    mesh.count = count;
    mesh.visible = count > 0;
    mesh.instanceMatrix.needsUpdate = mesh.visible;
  }

  /** Draws a line from each frame to its parent. */
  private putArrows(passes: (name: string) => boolean): void {
    const { transforms } = this.picture;
    const ends: number[] = [];
    const [at, above] = [new Matrix4(), new Matrix4()];
    for (const name of this.values["arrows"] === true ? transforms.names : []) {
      const parent = transforms.parent(name);
      if (!passes(name) || parent === "") continue;
      if (transforms.lookup(name, null, at) === null || transforms.lookup(parent, null, above) === null)
        continue;
      ends.push(...new Vector3().setFromMatrixPosition(at), ...new Vector3().setFromMatrixPosition(above));
    }
    this.arrows.visible = ends.length > 0;
    if (ends.length === 0) return;
    this.arrows.geometry.dispose();
    this.arrows.geometry = new BufferGeometry();
    this.arrows.geometry.setAttribute("position", new Float32BufferAttribute(ends, 3));
  }

  /** Returns the filter of frames by name. */
  private nameFilter(): (name: string) => boolean {
    const filter = matcher(String(this.values["filter"]));
    const without = String(this.values["without"]);
    const isExcluded = without === "" ? () => false : matcher(without);
    return (name) => filter(name) && !isExcluded(name);
  }

  /** Creates a label on first use, and places it above those that it would cover. */
  private putLabel(name: string, at: Matrix4, tall: number, taken: Rect[]): void {
    let sprite = this.labels.get(name);
    if (sprite === undefined) {
      sprite = label(name, this.picture.app.theme.value);
      this.labels.set(name, sprite);
      this.group.add(sprite);
    }
    sprite.position.setFromMatrixPosition(at);
    const [height, width] = [LABEL_PIXELS, LABEL_PIXELS * (sprite.userData["aspect"] as number)];
    const { x, y } = this.picture.onScreen(sprite.position);
    const place = { left: x - ANCHOR_X * width, top: y - (1 - ANCHOR_Y) * height, width, height };
    const steps = stepsUp(place, taken);
    taken.push({ ...place, top: place.top - steps * height });
    sprite.center.set(ANCHOR_X, ANCHOR_Y - steps);
    sprite.scale.set((tall * width) / height, tall, 1);
  }

  dispose(): void {
    this.free();
    this.arrows.geometry.dispose();
    this.arrows.material.dispose();
  }

  private free(): void {
    this.axes?.geometry.dispose();
    this.axes?.material.dispose();
    this.axes?.dispose();
    for (const sprite of this.labels.values()) {
      sprite.material.map?.dispose();
      sprite.material.dispose();
    }
  }
}

export const tf: Make = (picture) => new Frames(picture);

/** Instances to spare for frames that appear later. */
const SPARE = 64;

/** Returns a test for names that match a regular expression. An invalid one, such as while it is typed, is plain text. */
export function matcher(pattern: string): (name: string) => boolean {
  try {
    const expression = new RegExp(pattern);
    return (name) => expression.test(name);
  } catch {
    return (name) => name.includes(pattern);
  }
}

/** Creates the mesh for the axes of a number of frames. */
function axesMesh(rod: CylinderGeometry, frames: number): InstancedMesh<CylinderGeometry, MeshBasicMaterial> {
  const mesh = new InstancedMesh(
    rod,
    new MeshBasicMaterial({ depthTest: false, transparent: true }),
    COLOURS.length * frames,
  );
  for (let slot = 0; slot < mesh.count; slot += 1) mesh.setColorAt(slot, COLOURS[slot % COLOURS.length]!);
  mesh.frustumCulled = false;
  mesh.renderOrder = 8;
  mesh.count = 0;
  return mesh;
}

function label(text: string, theme: Theme): Sprite {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d")!;
  const font = "500 26px Inter, system-ui, sans-serif";
  context.font = font;
  canvas.width = Math.ceil(context.measureText(text).width) + 28;
  canvas.height = 44;
  context.font = font;
  context.fillStyle = theme === "dark" ? "rgba(12,16,21,.78)" : "rgba(255,255,255,.86)";
  context.beginPath();
  context.roundRect(0, 0, canvas.width, canvas.height, 10);
  context.fill();
  context.fillStyle = theme === "dark" ? "#e6ecf3" : "#18212c";
  context.textBaseline = "middle";
  context.fillText(text, 14, 23);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = "srgb";
  const sprite = new Sprite(
    new SpriteMaterial({
      map: texture,
      depthTest: false,
      transparent: true,
      sizeAttenuation: false,
      toneMapped: false,
    }),
  );
  sprite.renderOrder = 9;
  sprite.userData["aspect"] = canvas.width / canvas.height;
  return sprite;
}
