import type { App } from "../app";
import { download, h } from "../dom";
import { icon } from "../icons";
import type { View } from "../view/view";

/** Limit of each side. */
const MOST_PIXELS = 8192;
const FRAMES_PER_SECOND = 30;
/** Milliseconds between two frames of a still view. */
const STILL = 250;

/** The menu that saves an image, a video, the page as one HTML file, or a 3D model. */
export function saveMenu(app: App, view: () => View): HTMLElement {
  const size = (label: string): HTMLInputElement =>
    h("input", { type: "number", min: 1, max: MOST_PIXELS, step: 1, "aria-label": label });
  const [width, height] = [size("Width in pixels"), size("Height in pixels")];
  const transparent = h("input", { type: "checkbox" });
  const name = (): string => app.scene.value?.robot || "robot";
  const served = location.protocol.startsWith("http");
  const complain = (reason: string): void => app.refused.set({ reason });

  const savePicture = async (): Promise<void> => {
    if (!width.reportValidity() || !height.reportValidity()) return;
    const blob = await view().png({
      width: width.valueAsNumber,
      height: height.valueAsNumber,
      transparent: transparent.checked,
    });
    if (blob === null)
      complain(
        view().stage.draws ? "the image is too large for this browser" : "this browser cannot draw the image",
      );
    else download(blob, `${name()}.png`);
  };
  const saveFromServer = async (ending: "html" | "glb"): Promise<void> => {
    const answer = await fetch(`./export/robot.${ending}${location.search}`).catch(() => null);
    if (answer?.ok) download(await answer.blob(), `${name()}.${ending}`);
    else
      complain(
        `cannot create the ${ending.toUpperCase()} file: ${answer === null ? "the server does not answer" : await answer.text()}`,
      );
  };

  const film = h("button", { type: "button", "aria-pressed": "false" }, "Record a video (WebM)");
  let recorder: MediaRecorder | null = null;
  film.addEventListener("click", () => {
    if (recorder !== null) recorder.stop();
    else {
      recorder = record(
        view().stage.renderer.domElement,
        () => view().invalidate(),
        (blob) => {
          recorder = null;
          film.setAttribute("aria-pressed", "false");
          film.textContent = "Record a video (WebM)";
          download(blob, `${name()}.webm`);
        },
      );
      film.setAttribute("aria-pressed", "true");
      film.textContent = "Stop and save the video";
      view().invalidate();
    }
  });
  app.rendering.watch((now) => (film.hidden = now === "never" || !("MediaRecorder" in window)));

  const menu = h(
    "details",
    { class: "save-menu" },
    h(
      "summary",
      { title: "Save an image, a video, the page or a model", "aria-label": "Save" },
      icon("camera"),
    ),
    h(
      "div",
      { class: "save-sheet", role: "group", "aria-label": "Save" },
      h("div", { class: "save-size" }, width, "×", height, h("label", {}, transparent, "transparent")),
      h("button", { type: "button", onclick: () => void savePicture() }, "Image (PNG)"),
      film,
      served &&
        h(
          "button",
          { type: "button", onclick: () => void saveFromServer("html") },
          "Page in one file (HTML)",
        ),
      served && h("button", { type: "button", onclick: () => void saveFromServer("glb") }, "Model (GLB)"),
    ),
  );
  menu.addEventListener("toggle", () => {
    if (!menu.open) return;
    const canvas = view().stage.renderer.domElement;
    width.value = String(canvas.width);
    height.value = String(canvas.height);
  });
  // listens on the whole page, because a click moves the focus out of the menu
  const close = (event: Event): void => {
    if (!menu.open) return;
    menu.open = false;
    if (menu.contains(document.activeElement)) menu.querySelector("summary")?.focus();
    if (event.type === "keydown") event.stopPropagation();
  };
  addEventListener("keydown", (event) => event.key === "Escape" && close(event), true);
  addEventListener("pointerdown", (event) => menu.contains(event.target as Node) || close(event), true);
  return menu;
}

/** Records a video of a canvas until it is stopped. */
function record(canvas: HTMLCanvasElement, redraw: () => void, done: (film: Blob) => void): MediaRecorder {
  const type =
    ["video/webm;codecs=vp9", "video/webm;codecs=vp8"].find((candidate) =>
      MediaRecorder.isTypeSupported(candidate),
    ) ?? "video/webm";
  const recorder = new MediaRecorder(canvas.captureStream(FRAMES_PER_SECOND), {
    mimeType: type,
    videoBitsPerSecond: 8_000_000,
  });
  const chunks: Blob[] = [];
  recorder.addEventListener("dataavailable", (event) => chunks.push(event.data));
  const still = setInterval(redraw, STILL); // a video ends with its last frame, so a still view must be drawn again
  recorder.addEventListener("stop", () => {
    clearInterval(still);
    done(new Blob(chunks, { type: "video/webm" }));
  });
  recorder.start();
  return recorder;
}
