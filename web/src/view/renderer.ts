import { PCFShadowMap, WebGLRenderer } from "three";

declare global {
  interface Window {
    canvas?: HTMLCanvasElement;
  }
}

/** What the picture is drawn with. */
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

/** What draws on this browser, whether it does so without a graphics card, and whether it draws at all. */
export interface Drawing {
  renderer: Renderer;
  isSoftware: boolean;
  draws: boolean;
}

/** Where the browser has no WebGL, what draws nothing. */
export function startDrawing(): Drawing {
  const canvas = earlyCanvas();
  try {
    const renderer = new WebGLRenderer({ canvas, antialias: true, powerPreference: "high-performance" });
    return { renderer, isSoftware: isSoftware(renderer), draws: true };
  } catch {
    return { renderer: nothing(canvas), isSoftware: true, draws: false };
  }
}

/** The canvas whose context the page's own HTML has asked for already, where it has: used once. */
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

/** Keeps a canvas in its size, and draws nothing on it. */
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
