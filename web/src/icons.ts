const PATHS = {
  play: "M5 3.5v9l7.5-4.5z",
  pause: "M5 3.5v9M11 3.5v9",
  step: "M4 3.5v9l6-4.5zM12.5 3.5v9",
  reset: "M3.2 6.5A5.2 5.2 0 1 1 2.8 9M3 2.8v3.7h3.7",
  sun: "M8 5.2a2.8 2.8 0 1 0 0 5.6 2.8 2.8 0 0 0 0-5.6zM8 1v1.6M8 13.4V15M1 8h1.6M13.4 8H15M3 3l1.2 1.2M11.8 11.8 13 13M3 13l1.2-1.2M11.8 4.2 13 3",
  moon: "M13.2 9.6A5.6 5.6 0 0 1 6.4 2.8a5.6 5.6 0 1 0 6.8 6.8z",
  eye: "M1.2 8S3.6 3.6 8 3.6 14.8 8 14.8 8 12.4 12.4 8 12.4 1.2 8 1.2 8zM8 6.2a1.8 1.8 0 1 0 0 3.6 1.8 1.8 0 0 0 0-3.6z",
  box: "M8 1.6 14 4.8v6.4l-6 3.2-6-3.2V4.8zM2 4.8 8 8l6-3.2M8 8v6.4",
  weight: "M5.6 5.2h4.8l2.6 8.2H3zM8 1.8a1.7 1.7 0 1 0 0 3.4 1.7 1.7 0 0 0 0-3.4z",
  axes: "M6 10V2M6 10l8 1.6M6 10l-4 4M4.6 3.6 6 2l1.4 1.6",
  tag: "M2 2.6h5.2l6.6 6.6-4.8 4.8L2.4 7.4zM5 5.4h.01",
  grid: "M2 5.6h12M2 10.4h12M5.6 2v12M10.4 2v12",
  path: "M3 13c0-4 10-3 10-7a2.6 2.6 0 0 0-5.2 0M3 13h.01",
  follow: "M8 4.4a3.6 3.6 0 1 0 0 7.2 3.6 3.6 0 0 0 0-7.2zM8 1v3.4M8 11.6V15M1 8h3.4M11.6 8H15",
  fit: "M2 5.4V2h3.4M10.6 2H14v3.4M14 10.6V14h-3.4M5.4 14H2v-3.4",
  close: "M4 4l8 8M12 4l-8 8",
  error: "M8 1.6a6.4 6.4 0 1 0 0 12.8A6.4 6.4 0 0 0 8 1.6zM8 4.8v3.8M8 11h.01",
  warning: "M8 2 14.6 13.4H1.4zM8 6.4v3.2M8 11.4h.01",
  info: "M8 1.6a6.4 6.4 0 1 0 0 12.8A6.4 6.4 0 0 0 8 1.6zM8 7.4v4M8 5h.01",
  link: "M5.4 8h5.2M6.4 5H4.6a3 3 0 0 0 0 6h1.8M9.6 5h1.8a3 3 0 0 1 0 6H9.6",
  code: "M5.4 4.4 1.8 8l3.6 3.6M10.6 4.4 14.2 8l-3.6 3.6",
  joint: "M8 5.4a2.6 2.6 0 1 0 0 5.2 2.6 2.6 0 0 0 0-5.2zM1.6 8h3.8M10.6 8h3.8",
  drive: "M8 1.8 10.4 5H5.6zM8 14.2 5.6 11h4.8zM1.8 8 5 5.6v4.8zM14.2 8 11 10.4V5.6z",
  layers: "M8 2 14.4 5.6 8 9.2 1.6 5.6zM1.6 8.6 8 12.2l6.4-3.6M1.6 11.4",
  help: "M8 1.6a6.4 6.4 0 1 0 0 12.8A6.4 6.4 0 0 0 8 1.6zM6.2 6.2a1.9 1.9 0 1 1 2.6 1.8c-.5.2-.8.6-.8 1.2M8 11.4h.01",
  sliders: "M2 4.6h5M11 4.6h3M9 2.8v3.6M2 11.4h3M9 11.4h5M7 9.6v3.6",
  redo: "M13 6.4H6.4a3.4 3.4 0 0 0 0 6.8H11M10.2 3.4l3 3-3 3",
  undo: "M3 6.4h6.6a3.4 3.4 0 0 1 0 6.8H5M5.8 3.4 2.8 6.4l3 3",
  wand: "M3 13 10 6M11.4 1.8v2.4M10.2 3h2.4M14 6.4v1.8M13.1 7.3h1.8M6.6 2.4v1.4M5.9 3.1h1.4",
  save: "M8 2v7.4M4.8 6.4 8 9.6l3.2-3.2M2.6 12.8h10.8",
  camera: "M2 5h2.6L6 3h4l1.4 2H14v8H2zM8 6.6a2.2 2.2 0 1 0 0 4.4 2.2 2.2 0 0 0 0-4.4z",
  scan: "M8 13.4h.01M4.6 10.4a4.8 4.8 0 0 1 6.8 0M2.2 7.6a8.2 8.2 0 0 1 11.6 0",
  plot: "M2 2v12h12M4.4 10.4l2.6-3.6 2.4 2L13.4 4",
  chevron: "M6 3.6 10.4 8 6 12.4",
  up: "M8 13V3.4M3.8 7.4 8 3.2l4.2 4.2",
  down: "M8 3v9.6M3.8 8.6 8 12.8l4.2-4.2",
  pencil: "M2.8 13.2l.8-3.2 7.2-7.2 2.4 2.4L6 12.4zM9.4 4.2l2.4 2.4",
  pointer: "M3.4 2.4 12.8 8.2 8.6 9.2 6.4 13.2z",
  move: "M8 1.8v12.4M1.8 8h12.4M6.2 3.6 8 1.8l1.8 1.8M6.2 12.4 8 14.2l1.8-1.8M3.6 6.2 1.8 8l1.8 1.8M12.4 6.2 14.2 8l-1.8 1.8",
  goal: "M4 14.2V2M4 2.8h8.4l-2 2.8 2 2.8H4",
  estimate:
    "M8 14.4S3.4 9.8 3.4 6.4a4.6 4.6 0 0 1 9.2 0c0 3.4-4.6 8-4.6 8zM8 4.8a1.6 1.6 0 1 0 0 3.2 1.6 1.6 0 0 0 0-3.2z",
  point: "M8 1.6v4M8 10.4v4M1.6 8h4M10.4 8h4M8 8h.01",
  ruler: "M1.8 10.6 10.6 1.8l3.6 3.6-8.8 8.8zM4.6 7.8l1.6 1.6M7.2 5.2 8.8 6.8",
  push: "M2 8h7.4M6.4 5 9.4 8l-3 3M13 2.6v10.8",
  plus: "M8 3v10M3 8h10",
  list: "M2.4 4h.01M2.4 8h.01M2.4 12h.01M5.4 4h8.2M5.4 8h8.2M5.4 12h8.2",
  flag: "M4 14V2.4M4 3h8l-1.8 2.8L12 8.6H4",
  record: "M8 4.4a3.6 3.6 0 1 0 0 7.2 3.6 3.6 0 0 0 0-7.2z",
  branch: "M4 2v12M4 9.5c0-3.5 8-1.5 8-5.5M9.8 5.8 12 3.4l2.2 2.4",
  loop: "M11 1.8 13.4 4 11 6.2M2.6 7.4V6.6A2.6 2.6 0 0 1 5.2 4h8M5 14.2 2.6 12 5 9.8M13.4 8.6v.8a2.6 2.6 0 0 1-2.6 2.6h-8",
  check: "M3 8.6 6.4 12 13 4.4",
} as const;

export type IconName = keyof typeof PATHS;

const SVG = "http://www.w3.org/2000/svg";

/** An icon in the colour of the surrounding text, hidden from screen readers. */
export function icon(name: IconName): SVGSVGElement {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("class", `icon icon-${name}`);
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS(SVG, "path");
  path.setAttribute("d", PATHS[name]);
  svg.append(path);
  return svg;
}
