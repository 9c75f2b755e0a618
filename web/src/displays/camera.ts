import { CanvasTexture, Group, LinearFilter, SRGBColorSpace } from "three";

import { h } from "../dom";
import type * as msg from "../messages";
import type { Make } from "./display";
import { placeAtHeader } from "./frames";
import { PictureWindow } from "./picture-window";
import { Pinhole } from "./pinhole";
import { pixelsOf } from "./pixels";
import type { Status, Values } from "./set";

/** Camera: the scene from a camera's viewpoint, with its image in the background, as an overlay, or both. */
export const camera: Make = (picture) => {
  const window = new PictureWindow(picture.overlay, () => picture.invalidate());
  const taken = h("canvas", {});
  const texture = new CanvasTexture(taken);
  texture.colorSpace = SRGBColorSpace;
  texture.generateMipmaps = false;
  texture.minFilter = LinearFilter;
  const pinhole = new Pinhole();
  const group = new Group();
  group.add(pinhole.eye);
  let set: Values = {};
  let shown = false;
  let image: msg.Image | null = null;
  let info: msg.CameraInfo | null = null;
  let infoTopic = "";
  let stop = (): void => undefined;
  let canSee = false;
  const update = (): void => {
    canSee = info !== null && pinhole.see(info, Number(set["zoom"]), Number(set["far"]));
    window.show(shown && image !== null && canSee);
  };
  const subscribeInfo = (topic: string): void => {
    const wantedTopic = topic.replace(/[^/]*$/, "camera_info");
    if (wantedTopic === infoTopic) return;
    stop();
    infoTopic = wantedTopic;
    stop = picture.app.topics.subscribe(wantedTopic, ({ message }) => {
      info = message as unknown as msg.CameraInfo;
      update();
    });
  };
  const status = (): Status | null => {
    if (info === null) return { level: "warn", reason: `no CameraInfo received on ${infoTopic} yet` };
    return canSee
      ? null
      : { level: "error", reason: `the CameraInfo on ${infoTopic} has no valid projection matrix` };
  };
  return {
    group,
    configure(values, isShown) {
      set = values;
      shown = isShown;
      update();
    },
    message({ topic, message }) {
      image = message as unknown as msg.Image;
      subscribeInfo(topic);
      const colours = pixelsOf(image, { normalize: true });
      if (!(colours instanceof ImageData)) return colours;
      if (taken.width !== colours.width || taken.height !== colours.height) {
        Object.assign(taken, { width: colours.width, height: colours.height });
        texture.dispose(); // a texture cannot change its size
      }
      taken.getContext("2d")!.putImageData(colours, 0, 0);
      texture.needsUpdate = true;
      window.name(topic, `The scene from the camera of ${topic}, over its image`);
      update();
      return placeAtHeader(picture, group, image.header) ?? status();
    },
    look() {
      if (!window.isShown || image === null || !group.visible) return;
      const rendering = String(set["rendering"]);
      const context = window.canvas.getContext("2d")!;
      const scale = Math.min(1, (window.width * devicePixelRatio) / image.width);
      const [width, height] = [
        Math.max(1, Math.round(image.width * scale)),
        Math.max(1, Math.round(image.height * scale)),
      ];
      if (window.canvas.width !== width || window.canvas.height !== height)
        Object.assign(window.canvas, { width, height });
      context.globalAlpha = 1;
      picture.drawAs(
        pinhole.eye,
        context,
        rendering === "overlay" ? null : texture,
        (display) => set[`${display}/show`] !== false,
      );
      if (rendering === "background") return;
      context.globalAlpha = Number(set["alpha"]);
      context.drawImage(taken, 0, 0, width, height);
    },
    clear() {
      stop();
      [image, info, infoTopic, stop] = [null, null, "", () => undefined];
      update();
    },
    dispose() {
      stop();
      texture.dispose();
      window.remove();
    },
  };
};
