import { PCFShadowMap, WebGLRenderer } from "three";

declare global {
  interface Window {
    canvas?: HTMLCanvasElement;
  }
}

/** The parts of the renderer that the page uses. */
export type Renderer = Pick<
  WebGLRenderer,
  | "domElement"
  | "info"
  | "render"
  | "setPixelRatio"
  | "getPixelRatio"
  | "setSize"
  | "setViewport"
  | "setRenderTarget"
  | "readRenderTargetPixels"
> & { shadowMap: Pick<WebGLRenderer["shadowMap"], "enabled" | "type"> };

/** The renderer, whether it renders in software, and whether it draws at all. */
export interface Drawing {
  renderer: Renderer;
  isSoftware: boolean;
  draws: boolean;
}

/** Creates the renderer. Without WebGL it draws nothing. */
export function startDrawing(): Drawing {
  const canvas = earlyCanvas();
  try {
    const renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    return { renderer, isSoftware: isSoftware(renderer), draws: true };
  } catch {
    return { renderer: nothing(canvas), isSoftware: true, draws: false };
  }
}

/** The canvas whose context the page's HTML created early, or a new one. */
function earlyCanvas(): HTMLCanvasElement {
  const { canvas } = window;
  delete window.canvas;
  return canvas ?? document.createElement("canvas");
}

function isSoftware(renderer: WebGLRenderer): boolean {
  const gl = renderer.getContext();
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

/** A renderer that only sizes its canvas. */
function nothing(domElement: HTMLCanvasElement): Renderer {
  const none = (): void => undefined;
  return {
    domElement,
    info: { memory: { geometries: 0, textures: 0 }, programs: [] } as unknown as WebGLRenderer["info"],
    shadowMap: { enabled: false, type: PCFShadowMap },
    setSize: (width, height) => {
      Object.assign(domElement, { width, height });
      Object.assign(domElement.style, { width: `${width}px`, height: `${height}px` });
    },
    getPixelRatio: () => 1,
    render: none,
    setPixelRatio: none,
    setViewport: none,
    setRenderTarget: none,
    readRenderTargetPixels: none,
  };
}
