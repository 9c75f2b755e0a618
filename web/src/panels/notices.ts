import type { App } from "../app";
import { fallenText } from "../displays/fallen";
import { baseName, h } from "../dom";
import { icon } from "../icons";
import type { Finding } from "../protocol";
import { recordedText } from "../time/format";

/** Milliseconds for which a notice is shown. */
const SHOWN_FOR = 5000;
const UNDRAWN = {
  drawn: "",
  never:
    "This browser cannot draw the robot because it has no WebGL 2. Everything else works. Enable hardware acceleration in the browser's settings.",
  lost: "The browser lost the graphics context, so the robot is not drawn. Drawing continues when the browser restores it, or when you reload the page.",
} as const;

/** The first error, with its place, as a button that shows it. */
function brokenText(app: App, findings: readonly Finding[], hasRobot: boolean): HTMLElement {
  const errors = findings.filter((finding) => finding.severity === "error");
  const [first] = errors;
  const file = first?.place?.file ?? "";
  const shown = [
    app.drafts.isDeleted(file) && app.drafts.toSave.has(file) && "Save in the editor writes it again.",
    hasRobot
      ? "The view shows the last valid robot."
      : "The robot appears when you save a version without errors.",
  ]
    .filter(Boolean)
    .join(" ");
  if (first === undefined) return h("span", {}, shown);
  const where = first.place === null ? "" : `${baseName(first.place.file)}:${first.place.line}: `;
  const others = errors.length > 1 ? ` (and ${errors.length - 1} more)` : "";
  return h(
    "span",
    {},
    h(
      "button",
      {
        type: "button",
        class: "first-error",
        title: "Show this error",
        onclick: () => app.selectFinding(first),
      },
      h("span", { class: "where" }, where),
      first.message,
      others,
    ),
    h("span", { class: "shown" }, shown),
  );
}

/** A button that closes a notice. */
export function closeButton(label: string, close: () => void): HTMLButtonElement {
  return h(
    "button",
    { type: "button", class: "icon-button", title: "Close", "aria-label": label, onclick: close },
    icon("close"),
  );
}

/** Notices over the view: no graphics, a broken description, a lost connection, a refused request. */
export function notices(app: App, picture: HTMLElement): HTMLElement {
  const broken = h("div", { class: "notice error", role: "alert", hidden: true });
  const lostText = h("span");
  const lost = h("div", { class: "notice warning", role: "alert", hidden: true }, icon("warning"), lostText);
  const refused = h("div", { class: "notice info", role: "status", hidden: true });
  /** The error that the user has closed. Another one is shown again. */
  let closed = "";
  const showBroken = (): void => {
    const now = app.findings.value;
    const stale = now?.stale === true;
    picture.classList.toggle("stale", stale && app.scene.value?.links.length !== 0);
    broken.hidden = !stale;
    if (!stale) {
      closed = "";
      return;
    }
    const hasRobot = (app.scene.value?.links.length ?? 0) > 0;
    const text = brokenText(app, now.findings, hasRobot);
    const close = closeButton("Close this error", () => {
      closed = text.textContent;
      broken.hidden = true;
    });
    broken.hidden = text.textContent === closed;
    broken.replaceChildren(icon("error"), text, close);
  };
  app.findings.watch(showBroken);
  app.drafts.conflict.watch(showBroken); // the notice names how to restore a deleted file
  const full = h(
    "div",
    { class: "notice warning", role: "alert", hidden: true },
    icon("warning"),
    "The server has too many open tabs. Close another one. This tab reconnects automatically.",
  );
  app.connection.link.watch((link) => {
    lost.hidden = link !== "lost";
    lostText.textContent = app.connection.hasEnded
      ? "KBot has ended. The view shows the last state."
      : "No connection to the server. The view is out of date. Reconnecting…";
    full.hidden = link !== "full";
    const isLost = link === "lost" || link === "full";
    picture.classList.toggle("lost", isLost);
    document.documentElement.dataset["link"] = isLost ? "lost" : "live";
  });
  const undrawn = h("div", { class: "notice warning", role: "alert", hidden: true });
  app.rendering.watch((now) => {
    undrawn.hidden = now === "drawn";
    undrawn.replaceChildren(icon("warning"), UNDRAWN[now]);
  });
  let timer: ReturnType<typeof setTimeout> | undefined;
  const hide = (): void => void (refused.hidden = true);
  const showNotice = (text: string, ...actions: HTMLElement[]): void => {
    refused.replaceChildren(icon("info"), h("span", {}, text), ...actions);
    refused.hidden = false;
    clearTimeout(timer);
    if (actions.length === 0) timer = setTimeout(hide, SHOWN_FOR);
  };
  app.refused.watch((now) => now !== null && showNotice(now.reason));
  let known: readonly string[] = [];
  app.state.watch((state) => {
    const fallen = state?.fallen ?? [];
    const news = fallen.filter(({ name }) => !known.includes(name));
    known = fallen.map(({ name }) => name);
    if (news.length > 0) showNotice(news.map(fallenText).join("; "));
  });
  app.notice.watch((now) => now !== null && showNotice(now.text));
  app.recorded.watch((now) => {
    if (now === null) return;
    const name = baseName(now.file);
    const get = h(
      "a",
      { href: `.${now.address}${location.search}`, download: name, onclick: hide },
      "Download",
    );
    const close = closeButton("Close this notice", hide);
    showNotice(recordedText(now), ...(now.address === "" ? [] : [get]), close);
  });
  return h("div", { class: "notices" }, undrawn, broken, lost, full, refused);
}
