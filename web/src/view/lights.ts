import { DirectionalLight, HemisphereLight, type Scene, type Vector3 } from "three";

import type { Theme } from "../options";
import { PALETTES } from "./palette";

const [SKY, SUN, FILL] = [1.5, 2.1, 0.5] as const;

/** Sky, sun and a fill light from the other side. */
export class Lights {
  private readonly sky = new HemisphereLight(0xffffff, 0x666666, SKY);
  private readonly sun = new DirectionalLight(0xffffff, SUN);
  private readonly fill = new DirectionalLight(0xffffff, FILL);

  constructor(scene: Scene, hasShadows: boolean) {
    this.sun.castShadow = hasShadows;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.radius = 4;
    this.sun.shadow.bias = -0.0004;
    this.fill.position.set(-2, -1, 0.6);
    scene.add(this.sky, this.sun, this.sun.target, this.fill);
  }

  setTheme(theme: Theme): void {
    const palette = PALETTES[theme];
    this.sky.color.set(palette.sky);
    this.sky.groundColor.set(palette.ground);
  }

  /** Scales all lights. 1 is the default. */
  setBrightness(factor: number): void {
    this.sky.intensity = SKY * factor;
    this.sun.intensity = SUN * factor;
    this.fill.intensity = FILL * factor;
  }

  /** Aims the sun and its shadow at a point. */
  aimAt(centre: Vector3, radius: number): void {
    this.sun.target.position.copy(centre);
    this.sun.position.set(centre.x + radius * 1.6, centre.y - radius * 2.2, centre.z + radius * 4.5);
    const shadow = this.sun.shadow.camera;
    shadow.left = shadow.bottom = -radius * 2.2;
    shadow.right = shadow.top = radius * 2.2;
    shadow.near = radius;
    shadow.far = radius * 12;
    shadow.updateProjectionMatrix();
    this.sun.shadow.normalBias = radius * 0.004;
  }
}
