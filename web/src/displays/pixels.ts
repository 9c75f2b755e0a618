import type * as msg from "../messages";
import { viridis } from "./colours";
import type { Status, Values } from "./set";

/** Bytes per pixel, and the offsets of red, green and blue. */
const COLOURED: Record<string, readonly [number, number, number, number]> = {
  rgb8: [3, 0, 1, 2],
  bgr8: [3, 2, 1, 0],
  rgba8: [4, 0, 1, 2],
  bgra8: [4, 2, 1, 0],
  mono8: [1, 0, 0, 0],
  "8UC1": [1, 0, 0, 0],
  "8UC3": [3, 2, 1, 0],
  "8UC4": [4, 2, 1, 0],
  // Bayer images are shown as grey, by the brightness of each pixel
  bayer_rggb8: [1, 0, 0, 0],
  bayer_bggr8: [1, 0, 0, 0],
  bayer_gbrg8: [1, 0, 0, 0],
  bayer_grbg8: [1, 0, 0, 0],
};

/** Offsets in four bytes for two pixels: the luma of both, and the U and V they share. */
const BRIGHTNESS: Record<string, readonly [number, number, number, number]> = {
  yuv422: [1, 3, 0, 2],
  uyvy: [1, 3, 0, 2],
  yuv422_yuy2: [0, 2, 1, 3],
  yuyv: [0, 2, 1, 3],
};

/** Bytes per pixel of depth encodings. */
const DEPTHS: Record<string, number> = { "32FC1": 4, "16UC1": 2, mono16: 2 };

/** The pixels of an image. Depths are coloured by `normalize`, `near` and `far`. Returns an error if the image is invalid. */
export function pixelsOf(image: msg.Image, set: Values): ImageData | Status {
  const { width, height, step, encoding, data } = image;
  if (width * height === 0 || data.length < step * height)
    return { level: "error", reason: `${width} by ${height} pixels, but ${data.length} bytes of data` };
  const layout = COLOURED[encoding];
  const pair = BRIGHTNESS[encoding];
  const size = layout?.[0] ?? (pair !== undefined ? 2 : DEPTHS[encoding]);
  if (size === undefined)
    return {
      level: "error",
      reason: encoding === "" ? "the encoding is empty" : `encoding ${encoding} is not supported`,
    };
  if (step < width * size)
    return {
      level: "error",
      reason: `step is ${step} bytes, but ${width} pixels of ${encoding} need ${width * size}`,
    };
  const pixels = new ImageData(width, height);
  if (layout !== undefined) {
    const places = layout.slice(1);
    for (let row = 0, to = 0; row < height; row += 1) {
      for (let column = 0, at = row * step; column < width; column += 1, at += size, to += 4) {
        places.forEach((place, channel) => (pixels.data[to + channel] = data[at + place]!));
        pixels.data[to + 3] = 255;
      }
    }
    return pixels;
  }
  if (pair !== undefined) {
    for (let row = 0, to = 0; row < height; row += 1) {
      for (let column = 0; column < width; column += 1, to += 4) {
        const at = row * step + 4 * (column >> 1);
        const [y, u, v] = [
          data[at + pair[column & 1]!]!,
          data[at + pair[2]]! - 128,
          data[at + pair[3]]! - 128,
        ];
        pixels.data.set([y + 1.402 * v, y - 0.344 * u - 0.714 * v, y + 1.772 * u, 255], to);
      }
    }
    return pixels;
  }
  const depth = depths(image, size);
  let [low, high] = [Number(set["near"]), Number(set["far"])];
  if (set["normalize"] === true) {
    const finite = depth.filter(Number.isFinite);
    [low, high] = [
      finite.reduce((a, b) => Math.min(a, b), Infinity),
      finite.reduce((a, b) => Math.max(a, b), -Infinity),
    ];
  }
  depth.forEach((metres, pixel) => {
    const colour = Number.isFinite(metres) ? viridis(1 - (metres - low) / (high - low || 1)) : [0, 0, 0];
    colour.forEach((part, channel) => (pixels.data[pixel * 4 + channel] = part * 255));
    pixels.data[pixel * 4 + 3] = 255;
  });
  return pixels;
}

/** The depth of each pixel in m, NaN if unknown. `size` is the bytes per pixel. */
function depths({ width, height, step, data, is_bigendian }: msg.Image, size: number): number[] {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const little = is_bigendian === 0;
  return Array.from({ length: width * height }, (_, pixel) => {
    const at = Math.floor(pixel / width) * step + (pixel % width) * size;
    return size === 4 ? view.getFloat32(at, little) : view.getUint16(at, little) / 1000 || NaN;
  });
}
