import { OrthographicCamera, PerspectiveCamera, WebGLRenderer, type Object3D } from "three";

import type { Stage } from "./stage";

/** Size and background of a saved image. */
export interface Wanted {
  width: number;
  height: number;
  transparent: boolean;
}

/** Renders the current view as a PNG. A transparent image has no `ground`. Null if the browser cannot draw it. */
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

/** A copy of a camera with the same vertical extent and another aspect ratio. */
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
