import {
  CanvasTexture,
  CylinderGeometry,
  Group,
  InstancedMesh,
  Matrix4,
  MeshBasicMaterial,
  Object3D,
  Sprite,
  SpriteMaterial,
} from "three";

import type { Options, Theme } from "../options";
import type { Scene } from "../protocol";
import { AXES } from "./palette";

const LABEL_PIXELS = 22;
const COLOURS = [AXES.x, AXES.y, AXES.z];

/** Axes and names of the links' frames, sized to suit the robot. */
export class Frames {
  readonly group = new Group();
  private readonly axes: InstancedMesh[];
  private readonly labels = new Map<number, Sprite>();
  private readonly still: Matrix4[];
  private shown: Options | null = null;
  private selected = "";

  constructor(
    private readonly scene: Scene,
    private readonly links: readonly Object3D[],
    private readonly theme: Theme,
  ) {
    const length = scene.radius * 0.42;
    const rod = new CylinderGeometry(length * 0.022, length * 0.022, length, 10);
    this.axes = COLOURS.map((color) => {
      const material = new MeshBasicMaterial({ color, depthTest: false, transparent: true });
      const mesh = new InstancedMesh(rod, material, links.length);
      mesh.frustumCulled = false;
      mesh.renderOrder = 8;
      return mesh;
    });
    this.still = [
      new Matrix4().makeRotationZ(-Math.PI / 2).setPosition(length / 2, 0, 0),
      new Matrix4().setPosition(0, length / 2, 0),
      new Matrix4().makeRotationX(Math.PI / 2).setPosition(0, 0, length / 2),
    ];
    this.group.add(...this.axes);
  }

  show(options: Options, selected: string): void {
    this.shown = options;
    this.selected = selected;
  }

  /** Puts everything where the links are now; `perPixel` is a label's size for one CSS pixel. */
  follow(perPixel: number): void {
    const options = this.shown;
    if (options === null) return;
    const product = new Matrix4();
    let count = 0;
    this.links.forEach((link, index) => {
      const isSelected = this.scene.links[index]?.name === this.selected;
      this.putLabel(index, link, options.names || isSelected, LABEL_PIXELS * perPixel);
      if (!options.frames && !isSelected) return;
      this.axes.forEach((axis, which) => axis.setMatrixAt(count, product.multiplyMatrices(link.matrixWorld, this.still[which]!)));
      count += 1;
    });
    for (const axis of this.axes) {
      axis.count = count;
      axis.instanceMatrix.needsUpdate = true;
    }
  }

  /** Labels are made when they are first shown. */
  private putLabel(index: number, link: Object3D, shown: boolean, tall: number): void {
    let sprite = this.labels.get(index);
    if (sprite !== undefined) sprite.visible = shown;
    if (!shown) return;
    if (sprite === undefined) {
      sprite = label(this.scene.links[index]?.name ?? "", this.theme);
      this.labels.set(index, sprite);
      this.group.add(sprite);
    }
    sprite.position.setFromMatrixPosition(link.matrixWorld);
    sprite.scale.set(tall * (sprite.userData["aspect"] as number), tall, 1);
  }

  dispose(): void {
    this.axes[0]?.geometry.dispose();
    for (const axis of this.axes) axis.dispose();
    for (const sprite of this.labels.values()) {
      sprite.material.map?.dispose();
      sprite.material.dispose();
    }
  }
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
    new SpriteMaterial({ map: texture, depthTest: false, transparent: true, sizeAttenuation: false, toneMapped: false }),
  );
  sprite.center.set(-0.06, -0.25);
  sprite.renderOrder = 9;
  sprite.userData["aspect"] = canvas.width / canvas.height;
  return sprite;
}
