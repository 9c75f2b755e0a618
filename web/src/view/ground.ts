import { CircleGeometry, Color, DoubleSide, Mesh, ShaderMaterial, ShadowMaterial, Vector2, Vector3 } from "three";

import type { Theme } from "../options";
import { AXES, PALETTES, type Palette } from "./palette";

const VERTEX = /* glsl */ `
  varying vec2 place;
  void main() {
    vec4 world = modelMatrix * vec4(position, 1.0);
    place = world.xy;
    gl_Position = projectionMatrix * viewMatrix * world;
  }`;

// Colours are mixed as they are seen on a screen, which saves three powers at every pixel: without a graphics
// card the floor would otherwise cost a third of the picture.
const FRAGMENT = /* glsl */ `
  uniform vec3 floorColour, background, line, major, xAxis, yAxis;
  uniform vec2 centre;
  uniform vec3 under;
  uniform float cell, reach, lines, shade;
  varying vec2 place;
  float ruled(vec2 at, vec2 wide, vec2 perWide) {
    vec2 near = clamp(1.0 - abs(fract(at - 0.5) - 0.5) * perWide, 0.0, 1.0);
    vec2 faded = near * clamp(1.6 - 2.8 * wide, 0.0, 1.0);
    return max(faded.x, faded.y) * lines;
  }
  void main() {
    vec2 wide = fwidth(place);
    vec2 perWide = 1.0 / wide;
    float perCell = 1.0 / cell;
    float fade = clamp(1.33 - 1.33 * distance(place, centre) / reach, 0.0, 1.0);
    vec3 colour = floorColour;
    colour = mix(colour, line, ruled(place * perCell, wide * perCell, perWide * cell));
    colour = mix(colour, major, ruled(place * perCell * 0.1, wide * perCell * 0.1, perWide * cell * 10.0));
    vec2 onAxis = clamp(1.1 - abs(place) * perWide, 0.0, 1.0) * lines * 0.75;
    colour = mix(colour, xAxis, onAxis.y);
    colour = mix(colour, yAxis, onAxis.x);
    colour *= 1.0 - shade * (1.0 - smoothstep(0.15, 1.0, distance(place, under.xy) / under.z));
    gl_FragColor = vec4(mix(background, colour, fade), 1.0);
  }`;

/** By which light and what is seen of it differ, about. */
const GAMMA = 2.2;
/** After the solid things, so that what they hide of the floor is not painted. */
const LAST_OF_OPAQUE = 1;

/** The floor: a lit patch with a grid, around wherever the view is. */
export class Ground {
  readonly floor: Mesh<CircleGeometry, ShaderMaterial>;
  readonly shadow: Mesh<CircleGeometry, ShadowMaterial>;
  private palette: Palette = PALETTES.dark;
  private asked = { cell: 0, colour: "" };
  private ruler: object | null = null;
  /** Distance of the lines in m that suits the robot. */
  suited = 0.1;

  constructor() {
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: {
        floorColour: { value: new Color() },
        background: { value: new Color() },
        line: { value: new Color() },
        major: { value: new Color() },
        xAxis: { value: seen(AXES.x) },
        yAxis: { value: seen(AXES.y) },
        centre: { value: new Vector2() },
        cell: { value: 0.1 },
        reach: { value: 1 },
        lines: { value: 1 },
        under: { value: new Vector3(0, 0, 1) },
        shade: { value: 0 },
      },
      // it fades by colour: blending every sample of the picture costs a software renderer more than the rest
      depthWrite: false,
      side: DoubleSide,
      // beneath all that lies on it: paths, maps, markers
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 64,
    });
    const disc = new CircleGeometry(1, 64);
    this.floor = new Mesh(disc, material);
    this.floor.renderOrder = LAST_OF_OPAQUE;
    this.shadow = new Mesh(disc, new ShadowMaterial({ depthWrite: false, polygonOffset: true, polygonOffsetFactor: 1 }));
    this.shadow.receiveShadow = true;
    this.shadow.renderOrder = -1;
  }

  setTheme(theme: Theme): void {
    const palette = PALETTES[theme];
    const { uniforms } = this.floor.material;
    uniforms["floorColour"]!.value = seen(palette.floor);
    this.palette = palette;
    this.paintLines();
    this.shadow.material.opacity = palette.shadow;
  }

  /** The colour into which the floor fades. */
  setBackground(colour: number | string): void {
    this.floor.material.uniforms["background"]!.value = seen(colour);
  }

  /** Grid lines suited to a robot of this radius, at this height. */
  suit(radius: number, height: number): void {
    this.suited = 10 ** Math.round(Math.log10(radius * 0.8));
    this.floor.material.uniforms["cell"]!.value = this.asked.cell || this.suited;
    this.floor.position.z = this.shadow.position.z = height;
  }

  /** Darkens the floor softly beneath a thing of this radius: what stands in for shadows without a card. */
  shadeUnder(x: number, y: number, radius: number, strength: number): void {
    (this.floor.material.uniforms["under"]!.value as Vector3).set(x, y, radius);
    this.floor.material.uniforms["shade"]!.value = 1 - (1 - strength) ** (1 / GAMMA);
  }

  /** Whether there are lines, how far apart in m (0: as suits the robot), in which colour (empty: the theme's)
   * and how opaque. Of several that ask, the first decides. */
  rule(who: object, on: boolean, cell: number, colour: string, alpha: number): void {
    if (this.ruler !== null && this.ruler !== who) return;
    this.ruler = on ? who : null;
    const { uniforms } = this.floor.material;
    uniforms["lines"]!.value = on ? alpha : 0;
    this.asked = { cell, colour };
    uniforms["cell"]!.value = cell || this.suited;
    this.paintLines();
  }

  isRuledBy(who: object): boolean {
    return this.ruler === who;
  }

  showFloor(on: boolean): void {
    this.floor.visible = this.shadow.visible = on;
  }

  private paintLines(): void {
    const { uniforms } = this.floor.material;
    const { colour } = this.asked;
    uniforms["line"]!.value = seen(colour || this.palette.line);
    uniforms["major"]!.value = seen(colour || this.palette.majorLine);
  }

  /** Keeps the patch around what is looked at, so that it never ends within the picture's reach. */
  follow(x: number, y: number, viewDistance: number): void {
    const reach = viewDistance * 4;
    for (const mesh of [this.floor, this.shadow]) {
      mesh.position.x = x;
      mesh.position.y = y;
      mesh.scale.set(reach, reach, 1);
      mesh.updateMatrix();
    }
    (this.floor.material.uniforms["centre"]!.value as Vector2).set(x, y);
    this.floor.material.uniforms["reach"]!.value = reach;
  }
}

/** A colour as it is seen on a screen, not as light adds up. */
function seen(colour: number | string): Color {
  return new Color(colour).convertLinearToSRGB();
}
