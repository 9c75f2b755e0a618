import {
  CircleGeometry,
  Color,
  DoubleSide,
  Mesh,
  ShaderMaterial,
  ShadowMaterial,
  type Object3D,
} from "three";

import type { Theme } from "../options";
import { ContactShadows } from "./contact-shadows";
import { AXES, PALETTES, type Palette } from "./palette";

// `at` is in cells, with lines where its fraction is 0.5.
const VERTEX = /* glsl */ `
  uniform float cell;
  varying vec2 at;
  varying float fade;
  void main() {
    vec4 world = modelMatrix * vec4(position, 1.0);
    at = world.xy / cell - 0.5;
    fade = 1.33 * (1.0 - length(position.xy));
    gl_Position = projectionMatrix * viewMatrix * world;
  }`;

// In software rendering the floor costs as much as everything on it, so each operation counts. Colours are constants
// in the program, because uniforms are fetched for each pixel. They are mixed in sRGB, which saves three powers. No
// value is clamped twice.
const FRAGMENT = /* glsl */ `
  varying vec2 at;
  varying float fade;
  void main() {
    vec2 wide = fwidth(at);
    vec2 perWide = 1.0 / wide;
    vec2 small = max(1.0 - abs(fract(at) - 0.5) * perWide, 0.0) * min(1.6 - 2.8 * wide, 1.0);
    vec2 large = max(1.0 - abs(fract(at * 0.1 - 0.45) - 0.5) * (perWide * 10.0), 0.0) * min(1.6 - 0.28 * wide, 1.0);
    vec2 onAxis = clamp(1.1 - abs(at + 0.5) * perWide, 0.0, 1.0) * (LINES * 0.75);
    vec3 colour = mix(FLOOR, LINE, max(max(small.x, small.y), 0.0) * LINES);
    colour = mix(colour, MAJOR, max(max(large.x, large.y), 0.0) * LINES);
    colour = mix(colour, X_AXIS, onAxis.y);
    colour = mix(colour, Y_AXIS, onAxis.x);
    gl_FragColor = vec4(mix(BACKGROUND, colour, clamp(fade, 0.0, 1.0)), 1.0);
  }`;

/** Render order after solid objects, so that hidden parts of the floor are not shaded. */
const LAST_OF_OPAQUE = 1;

/** The floor: a lit disc with a grid, centred on the view. */
export class Ground {
  readonly floor: Mesh<CircleGeometry, ShaderMaterial>;
  readonly shadow: Mesh<CircleGeometry, ShadowMaterial>;
  readonly contacts = new ContactShadows();
  /** Strength of the contact shadows: they add to the shadows of the sun, if there are any. */
  contactShare = 1;
  private palette: Palette = PALETTES.dark;
  private readonly requested = { cell: 0, colour: "", background: "" };
  private gridOwner: object | null = null;
  /** Default distance of the grid lines in m, by the size of the robot. */
  autoCell = 0.1;

  constructor() {
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      uniforms: { cell: { value: 0.1 } },
      defines: { X_AXIS: srgbConstant(AXES.x), Y_AXIS: srgbConstant(AXES.y), LINES: glsl(1) },
      // fades by colour, because blending every sample costs a software renderer more than everything else
      depthWrite: false,
      side: DoubleSide,
      // below everything that lies on it: paths, maps, markers
      polygonOffset: true,
      polygonOffsetFactor: 1,
      polygonOffsetUnits: 64,
    });
    const disc = new CircleGeometry(1, 64);
    this.floor = new Mesh(disc, material);
    this.floor.renderOrder = LAST_OF_OPAQUE;
    this.shadow = new Mesh(
      disc,
      new ShadowMaterial({ depthWrite: false, polygonOffset: true, polygonOffsetFactor: 1 }),
    );
    this.shadow.receiveShadow = true;
    this.shadow.renderOrder = -1;
  }

  /** Everything that is drawn as part of the floor. */
  get objects(): readonly Object3D[] {
    return [this.floor, this.shadow, this.contacts.group];
  }

  setTheme(theme: Theme): void {
    const palette = PALETTES[theme];
    this.palette = palette;
    this.setBackground(this.requested.background);
    this.shadow.material.opacity = palette.shadow;
    this.contacts.setDarkness(palette.contact * this.contactShare);
  }

  /** Sets the colour that the floor fades to. A colour other than the theme's is also the floor's, since rviz has no floor. */
  setBackground(requested: string): void {
    const { palette } = this;
    this.define("BACKGROUND", srgbConstant(requested || palette.background));
    this.define("FLOOR", srgbConstant(requested || palette.floor));
    this.requested.background = requested;
    this.paintLines();
  }

  /** Sets the default cell size for a robot's radius, and the height of the floor. */
  fitTo(radius: number, height: number): void {
    this.autoCell = 10 ** Math.round(Math.log10(radius * 0.8));
    this.floor.material.uniforms["cell"]!.value = this.requested.cell || this.autoCell;
    this.floor.position.z = this.shadow.position.z = height;
    this.contacts.fitTo(radius, height);
  }

  /** Sets the grid lines: their distance in m (0: default), colour (empty: the theme's) and opacity. Only the first `who`
   * has control, until it turns the lines off. */
  setGrid(owner: object, on: boolean, cell: number, colour: string, alpha: number): void {
    if (this.gridOwner !== null && this.gridOwner !== owner) return;
    this.gridOwner = on ? owner : null;
    this.define("LINES", glsl(on ? alpha : 0));
    Object.assign(this.requested, { cell, colour });
    this.floor.material.uniforms["cell"]!.value = cell || this.autoCell;
    this.paintLines();
  }

  isGridOwner(owner: object): boolean {
    return this.gridOwner === owner;
  }

  showFloor(on: boolean): void {
    for (const object of this.objects) object.visible = on;
  }

  private paintLines(): void {
    const { colour, background } = this.requested;
    this.define(
      "LINE",
      srgbConstant(colour || (background ? contrasting(background, 0.1) : this.palette.line)),
    );
    this.define(
      "MAJOR",
      srgbConstant(colour || (background ? contrasting(background, 0.25) : this.palette.majorLine)),
    );
  }

  /** Sets a constant of the floor's program, and compiles the program again if the value changed. */
  private define(name: string, value: string): void {
    const { material } = this.floor;
    if (material.defines[name] === value) return;
    material.defines[name] = value;
    material.dispose(); // frees the old program
    material.needsUpdate = true;
  }

  /** Centres the disc on the point looked at, large enough that its edge is never visible. */
  follow(x: number, y: number, viewDistance: number): void {
    const reach = viewDistance * 4;
    for (const mesh of [this.floor, this.shadow]) {
      mesh.position.x = x;
      mesh.position.y = y;
      mesh.scale.set(reach, reach, 1);
      mesh.updateMatrix();
    }
  }
}

/** A contrasting colour: `part` of the way to white, or to black for a light colour. */
function contrasting(colour: string, part: number): Color {
  const from = new Color(colour);
  return from.lerpHSL(new Color(from.getHSL({ h: 0, s: 0, l: 0 }).l < 0.5 ? "white" : "black"), part);
}

/** A colour in sRGB as a GLSL constant. */
function srgbConstant(colour: number | string | Color): string {
  const { r, g, b } = new Color(colour).convertLinearToSRGB();
  return `vec3(${[r, g, b].map(glsl).join()})`;
}

function glsl(value: number): string {
  return value.toFixed(5);
}
