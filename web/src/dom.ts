type Child = Node | string | null | undefined | false;
type Props = Record<string, string | number | boolean | null | undefined | ((event: never) => void)>;

/** Creates an element with attributes and children. Functions named `on…` become event listeners. */
export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (value === null || value === undefined || value === false) continue;
    if (typeof value === "function") element.addEventListener(name.slice(2), value as EventListener);
    else element.setAttribute(name, value === true ? "" : String(value));
  }
  element.append(
    ...children.filter(
      (child): child is Node | string => child !== null && child !== undefined && child !== false,
    ),
  );
  return element;
}

/** Sets an element's text if it differs. Setting the same text would trigger a layout. */
export function write(element: HTMLElement, text: string): void {
  const { firstChild } = element;
  if (!(firstChild instanceof Text)) element.textContent = text;
  else if (firstChild.data !== text) firstChild.data = text;
}

/** A panel with a title. */
export function panel(id: string, title: string, head: Child[], ...body: Child[]): HTMLElement {
  return h(
    "section",
    { class: "panel", id, "aria-label": title },
    h("header", { class: "panel-head" }, h("h2", {}, title), ...head),
    h("div", { class: "panel-body" }, ...body),
  );
}

/** A label that marks a panel as current while the view shows the past. */
export function ofNow(): HTMLElement {
  return h(
    "span",
    { class: "of-now", title: "The view shows the past. This panel shows the current state." },
    "current",
  );
}

/** A number with a fixed number of decimals, without a minus sign on zero. */
export function rounded(value: number, digits: number): string {
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text;
}

/** A number that changes often. Screen readers read it on request and do not announce each change. */
export function readout(label: string, props: Props = {}): HTMLOutputElement {
  return h("output", { "aria-label": label, "aria-live": "off", ...props });
}

/** A toggle button. */
export function toggle(
  label: string,
  title: string,
  on: boolean,
  change: (on: boolean) => void,
  ...content: Child[]
): HTMLButtonElement {
  const button = h(
    "button",
    { class: "toggle", type: "button", title, "aria-label": label, "aria-pressed": String(on) },
    ...(content.length ? content : [label]),
  );
  button.addEventListener("click", () => change(button.getAttribute("aria-pressed") !== "true"));
  return button;
}

/** Downloads a file. */
export function download(content: Blob, name: string): void {
  const address = URL.createObjectURL(content);
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** The last part of a path. */
export function baseName(path: string): string {
  return path.split(/[\\/]/).pop() ?? path;
}
