type Child = Node | string | null | undefined | false;
type Props = Record<string, string | number | boolean | null | undefined | ((event: never) => void)>;

/** An element with properties, attributes and children; `on…` functions become listeners. */
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

/** Writes a text where it is another than before: to put the same one there would lay the page out anew. */
export function write(element: HTMLElement, text: string): void {
  const { firstChild } = element;
  if (!(firstChild instanceof Text)) element.textContent = text;
  else if (firstChild.data !== text) firstChild.data = text;
}

/** A titled part of the page. */
export function panel(id: string, title: string, head: Child[], ...body: Child[]): HTMLElement {
  return h(
    "section",
    { class: "panel", id, "aria-label": title },
    h("header", { class: "panel-head" }, h("h2", {}, title), ...head),
    h("div", { class: "panel-body" }, ...body),
  );
}

/** Says of a panel, while a moment that was is on show, that it tells of what is. */
export function ofNow(): HTMLElement {
  return h(
    "span",
    { class: "of-now", title: "The picture shows a moment that was; this is as it is now" },
    "as it is now",
  );
}

/** A number of so many digits, without a sign on zero. */
export function rounded(value: number, digits: number): string {
  const text = value.toFixed(digits);
  return Number(text) === 0 ? (0).toFixed(digits) : text;
}

/** A number that changes by itself: it is there to be read, and not told at each change to who hears the page. */
export function readout(label: string, props: Props = {}): HTMLOutputElement {
  return h("output", { "aria-label": label, "aria-live": "off", ...props });
}

/** A button that is on or off. */
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

/** Hands a file to the browser to save. */
export function download(content: Blob, name: string): void {
  const address = URL.createObjectURL(content);
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}

/** The last part of a path. */
export function baseName(path: string): string {
  return path.split(/[\\/]/).pop() ?? path;
}
