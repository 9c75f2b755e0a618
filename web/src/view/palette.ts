import type { Theme } from "../options";

/** Colours of the view for one theme. */
export interface Palette {
  background: number;
  floor: number;
  line: number;
  majorLine: number;
  edge: number;
  trail: number;
  sky: number;
  ground: number;
  shadow: number;
  /** Opacity of the shadow where an object touches the floor. */
  contact: number;
}

export const PALETTES: Record<Theme, Palette> = {
  dark: {
    background: 0x0f1318,
    floor: 0x1b222b,
    line: 0x2a333f,
    majorLine: 0x3d4a5a,
    edge: 0xc9d6e6,
    trail: 0x4a9eff,
    sky: 0xe9f1ff,
    ground: 0x59626e,
    shadow: 0.5,
    contact: 0.85,
  },
  light: {
    background: 0xeef1f5,
    floor: 0xfbfcfd,
    line: 0xdde2e9,
    majorLine: 0xbcc5d0,
    edge: 0x1a2430,
    trail: 0x0b6fd3,
    sky: 0xffffff,
    ground: 0xb9c0c9,
    shadow: 0.22,
    contact: 0.42,
  },
};

export const AXES = { x: 0xe5484d, y: 0x46a758, z: 0x3e7bfa };
export const SELECTED = 0xffb224;
export const COLLISION = 0xff8a3d;
export const INERTIA = 0xb583ff;
