import { OrthographicCamera, PerspectiveCamera, WebGLRenderer, type Object3D } from "three";

import type { Stage } from "./stage";

/** How a saved picture is to be. */
export interface Wanted {
  width: number;
  height: number;
  transparent: boolean;
}

/** A PNG of exactly this size, seen as the stage is seen now; `ground` is left out where it is transparent. None where the browser draws none. */
export async function takePicture(
  stage: Stage,
  ground: readonly Object3D[],
  { width, height, transparent }: Wanted,
): Promise<Blob | null> {
  if (!stage.draws) return null;
  const renderer = new WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  renderer.setPixelRatio(1);
  renderer.setSize(width, height, false);
  renderer.shadowMap.enabled = stage.hasShadows;
  renderer.setClearAlpha(0);
  const { scene } = stage;
  const { background } = scene;
  const shown = ground.filter((object) => object.visible);
  if (transparent) {
    scene.background = null;
    for (const object of shown) object.visible = false;
  }
  renderer.render(scene, shaped(stage.camera, width / height));
  scene.background = background;
  for (const object of shown) object.visible = true;
  const blob = await new Promise<Blob | null>((resolve) => renderer.domElement.toBlob(resolve));
  renderer.dispose();
  renderer.forceContextLoss();
  return blob;
}

/** A camera that sees as high as another, and as wide as the picture is. */
function shaped(
  camera: PerspectiveCamera | OrthographicCamera,
  aspect: number,
): PerspectiveCamera | OrthographicCamera {
  const eye = camera.clone();
  if (eye instanceof PerspectiveCamera) eye.aspect = aspect;
  else {
    eye.right = eye.top * aspect;
    eye.left = -eye.right;
  }
  eye.updateProjectionMatrix();
  return eye;
}
