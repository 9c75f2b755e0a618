import {
  Color,
  InstancedMesh,
  Mesh,
  MeshBasicMaterial,
  NearestFilter,
  Scene,
  WebGLRenderTarget,
} from "three";

import type { Batch } from "./batches";
import type { Renderer } from "./renderer";
import type { Camera } from "./stage";

const NOTHING = 0;

interface Entry {
  mesh: Mesh;
  visible: () => boolean;
}

/** Finds the object at each pixel by drawing every object in its own colour. */
export class IdBuffer {
  private readonly scene = new Scene();
  private readonly entries: Entry[] = [];
  private readonly batches = new Map<Batch, InstancedMesh>();
  private readonly white = new MeshBasicMaterial({ toneMapped: false });
  private readonly materials = new Map<number, MeshBasicMaterial>();
  private readonly pixel = new WebGLRenderTarget(1, 1, {
    minFilter: NearestFilter,
    magFilter: NearestFilter,
  });

  constructor(private readonly renderer: Renderer) {
    this.scene.background = new Color(0);
    this.scene.matrixWorldAutoUpdate = false;
  }

  /** Adds a mesh with an id from 0. It follows the mesh's transform. */
  add(original: Mesh, id: number, visible: () => boolean): void {
    const mesh = new Mesh(original.geometry, this.material(id + 1));
    mesh.matrixAutoUpdate = mesh.matrixWorldAutoUpdate = false;
    mesh.matrixWorld = original.matrixWorld;
    mesh.frustumCulled = false;
    this.scene.add(mesh);
    this.entries.push({ mesh, visible });
  }

  /** Adds a batch, each object with its own id. They follow the batch's transforms. */
  addBatch(batch: Batch): void {
    const mesh = new InstancedMesh(batch.mesh.geometry, this.white, 0);
    mesh.instanceMatrix = batch.mesh.instanceMatrix;
    mesh.count = batch.numbers.length;
    mesh.frustumCulled = false;
    const color = new Color();
    batch.numbers.forEach((number, slot) => mesh.setColorAt(slot, coded(color, number + 1)));
    this.scene.add(mesh);
    this.batches.set(batch, mesh);
  }

  remove(batch: Batch): void {
    this.batches.get(batch)?.removeFromParent();
    this.batches.delete(batch);
  }

  clear(): void {
    this.scene.clear();
    this.entries.length = 0;
    this.batches.clear();
  }

  /** The id at a point of the view, in CSS pixels from its top left, -1 for none. */
  at(camera: Camera, x: number, y: number, width: number, height: number): number {
    const eye = camera.clone();
    eye.setViewOffset(width, height, Math.floor(x), Math.floor(y), 1, 1);
    const bytes = this.read(eye, this.pixel, 1, 1);
    return number(bytes, 0);
  }

  /** The id at each pixel, row by row from the top, -1 for none. */
  image(camera: Camera, width: number, height: number): Int16Array {
    const target = new WebGLRenderTarget(width, height, {
      minFilter: NearestFilter,
      magFilter: NearestFilter,
    });
    const bytes = this.read(camera, target, width, height);
    target.dispose();
    const image = new Int16Array(width * height);
    for (let row = 0; row < height; row += 1) {
      for (let column = 0; column < width; column += 1) {
        image[row * width + column] = number(bytes, ((height - 1 - row) * width + column) * 4);
      }
    }
    return image;
  }

  private read(camera: Camera, target: WebGLRenderTarget, width: number, height: number): Uint8Array {
    for (const entry of this.entries) entry.mesh.visible = entry.visible();
    const shadows = this.renderer.shadowMap.enabled;
    this.renderer.shadowMap.enabled = false;
    this.renderer.setRenderTarget(target);
    this.renderer.render(this.scene, camera);
    const bytes = new Uint8Array(width * height * 4);
    this.renderer.readRenderTargetPixels(target, 0, 0, width, height, bytes);
    this.renderer.setRenderTarget(null);
    this.renderer.shadowMap.enabled = shadows;
    return bytes;
  }

  private material(code: number): MeshBasicMaterial {
    let material = this.materials.get(code);
    if (material === undefined) {
      const color = coded(new Color(), code);
      material = new MeshBasicMaterial({ color, toneMapped: false });
      this.materials.set(code, material);
    }
    return material;
  }
}

/** Encodes a number from 1 as a colour, in the linear space of the render target. */
function coded(color: Color, code: number): Color {
  return color.setRGB((code & 255) / 255, (code >> 8) / 255, 1, "srgb-linear");
}

function number(bytes: Uint8Array, at: number): number {
  return (bytes[at + 2] ?? 0) === NOTHING ? -1 : (bytes[at] ?? 0) + ((bytes[at + 1] ?? 0) << 8) - 1;
}
