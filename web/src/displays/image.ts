import { Group } from "three";

import type * as msg from "../messages";
import type { Make } from "./display";
import { PictureWindow } from "./picture-window";
import { pixelsOf } from "./pixels";
import type { Status, Values } from "./set";

/** A camera's picture, in a window over the robot's. */
export const image: Make = (picture) => {
  const window = new PictureWindow(picture.overlay);
  let set: Values = {};
  let shown = false;
  let heard: msg.Image | null = null;
  const draw = (): Status | null => {
    window.show(shown && heard !== null);
    if (heard === null) return null;
    const colours = pixelsOf(heard, set);
    if (!(colours instanceof ImageData)) return colours;
    Object.assign(window.canvas, { width: heard.width, height: heard.height });
    window.canvas.getContext("2d")!.putImageData(colours, 0, 0);
    return null;
  };
  return {
    group: new Group(),
    configure(values, isShown) {
      set = values;
      shown = isShown;
      draw();
    },
    message({ topic, message }) {
      heard = message as unknown as msg.Image;
      window.name(topic, `Picture of ${topic}, ${heard.width} by ${heard.height}`);
      return draw();
    },
    clear() {
      heard = null;
      draw();
    },
    dispose: () => window.remove(),
  };
};
