import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  Color,
  InstancedMesh,
  Matrix4,
  MeshLambertMaterial,
  PerspectiveCamera,
  Points,
  PointsMaterial,
  Sphere,
  Vector2,
  Vector4,
  type Camera,
  type WebGLRenderer,
} from "three";

import type { Values } from "./set";

export type Drawn = Points<BufferGeometry, PointsMaterial> | InstancedMesh<BoxGeometry, MeshLambertMaterial>;

/** Draws points as squares with a size in pixels, or as squares, spheres or boxes with a size in m. */
export class PointShapes {
  private readonly flat = new PointsMaterial({ toneMapped: false, transparent: true });
  private readonly solid = new MeshLambertMaterial();
  private ball: CanvasTexture | null = null;
  private style = "points";
  private metres = 0.01;

  /** `colour` is the colour of all points, null if each has its own. */
  set(values: Values, colour: string | null): void {
    const { flat, solid } = this;
    this.style = String(values["style"]);
    this.metres = Number(values["metres"]);
    const alpha = Number(values["alpha"]);
    for (const material of [flat, solid]) material.color = new Color(colour ?? 0xffffff);
    flat.vertexColors = colour === null;
    flat.opacity = solid.opacity = alpha;
    solid.transparent = alpha < 1;
    flat.size = Number(values["size"]);
    flat.sizeAttenuation = this.style !== "points";
    flat.map = this.style === "spheres" ? (this.ball ??= ballTexture()) : null;
    flat.alphaTest = flat.map === null ? 0 : alpha / 2;
    flat.needsUpdate = true;
  }

  /** Draws points, optionally with a colour (r, g, b, linear) for each. */
  make(places: Float32Array, colours: Float32Array | null): Drawn {
    const drawn = this.style === "boxes" ? this.boxes(places, colours) : this.points(places, colours);
    drawn.frustumCulled = false;
    return drawn;
  }

  drop(drawn: Drawn): void {
    drawn.removeFromParent();
    drawn.geometry.dispose();
    if (drawn instanceof InstancedMesh) drawn.dispose();
  }

  dispose(): void {
    this.flat.dispose();
    this.solid.dispose();
    this.ball?.dispose();
  }

  private points(places: Float32Array, colours: Float32Array | null): Drawn {
    const points = new Points(new BufferGeometry(), this.flat);
    points.geometry.setAttribute("position", new BufferAttribute(places, 3));
    points.geometry.boundingSphere = new Sphere(); // otherwise three computes it from all points, only to sort this one object
    if (colours !== null) points.geometry.setAttribute("color", new BufferAttribute(colours, 3));
    if (this.style !== "points")
      points.onBeforeRender = (renderer, _scene, camera) =>
        (this.flat.size = sizeFor(this.metres, renderer, camera));
    return points;
  }

  private boxes(places: Float32Array, colours: Float32Array | null): Drawn {
    const count = places.length / 3;
    const boxes = new InstancedMesh(
      new BoxGeometry(this.metres, this.metres, this.metres),
      this.solid,
      count,
    );
    const at = new Matrix4();
    const colour = new Color();
    for (let i = 0; i < count; i += 1) {
      boxes.setMatrixAt(i, at.setPosition(places[3 * i]!, places[3 * i + 1]!, places[3 * i + 2]!));
      if (colours !== null) boxes.setColorAt(i, colour.fromArray(colours, 3 * i));
    }
    return boxes;
  }
}

/** The size for three's PointsMaterial that appears `metres` large. three does not account for the field of view. */
function sizeFor(metres: number, renderer: WebGLRenderer, camera: Camera): number {
  const high = renderer.getCurrentViewport(new Vector4()).w;
  const projected = metres * camera.projectionMatrix.elements[5];
  if (camera instanceof PerspectiveCamera)
    return (projected * high) / renderer.getDrawingBufferSize(new Vector2()).y;
  return (projected * high) / 2 / renderer.getPixelRatio();
}

/** The image of a shaded ball, lit from above. */
function ballTexture(): CanvasTexture {
  const size = 64;
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size;
  const context = canvas.getContext("2d")!;
  const shade = context.createRadialGradient(size * 0.4, size * 0.35, 0, size / 2, size / 2, size / 2);
  shade.addColorStop(0, "#fff");
  shade.addColorStop(1, "#777");
  context.fillStyle = shade;
  context.beginPath();
  context.arc(size / 2, size / 2, size / 2, 0, 2 * Math.PI);
  context.fill();
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = "srgb";
  return texture;
}
