import { Group } from "three";

import type * as msg from "../messages";
import type { Make } from "./display";
import { PictureWindow } from "./picture-window";
import { pixelsOf } from "./pixels";
import type { Status, Values } from "./set";

/** Image: a camera image in a window over the view. */
export const image: Make = (picture) => {
  const window = new PictureWindow(picture.overlay);
  let set: Values = {};
  let shown = false;
  let latest: msg.Image | null = null;
  let compressed: msg.CompressedImage | null = null;
  const draw = (): Status | null => {
    window.show(shown && (latest ?? compressed) !== null);
    if (latest === null) return null;
    const colours = pixelsOf(latest, set);
    if (!(colours instanceof ImageData)) return colours;
    Object.assign(window.canvas, { width: latest.width, height: latest.height });
    window.canvas.getContext("2d")!.putImageData(colours, 0, 0);
    return null;
  };
  /** Decodes and draws a JPEG or PNG, unless a newer one arrives meanwhile. */
  const unpack = async (message: msg.CompressedImage, topic: string): Promise<Status | null> => {
    compressed = message;
    if (message.format.includes("compressedDepth"))
      return { level: "error", reason: "compressed depth images are not supported" };
    try {
      const bitmap = await createImageBitmap(new Blob([message.data as Uint8Array<ArrayBuffer>]));
      if (compressed !== message) return null;
      const { width, height } = bitmap;
      Object.assign(window.canvas, { width, height });
      window.canvas.getContext("2d")!.drawImage(bitmap, 0, 0);
      bitmap.close();
      window.name(topic, `Image on ${topic}, ${width} by ${height}`);
      draw();
      return null;
    } catch {
      return { level: "error", reason: `cannot decode the image (${message.format || "no format"})` };
    }
  };
  return {
    group: new Group(),
    configure(values, isShown) {
      set = values;
      shown = isShown;
      draw();
    },
    message({ topic, kind, message }) {
      if (kind.endsWith("CompressedImage")) return unpack(message as unknown as msg.CompressedImage, topic);
      latest = message as unknown as msg.Image;
      window.name(topic, `Image on ${topic}, ${latest.width} by ${latest.height}`);
      return draw();
    },
    clear() {
      latest = compressed = null;
      draw();
    },
    dispose: () => window.remove(),
  };
};
