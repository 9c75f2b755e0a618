import type { App } from "../app";
import { h } from "../dom";

/** Pixels of a drag that change the last digit by 1. */
const PIXELS_A_STEP = 6;

/** The position of a number in a file, and its text. */
interface Spot {
  file: string;
  line: number;
  column: number;
  was: string;
}

/** Lets the user drag numbers in the source sideways, or edit them after a double click. */
export function editNumbers(app: App, body: HTMLElement): void {
  app.about.watch(() => body.classList.toggle("editable", app.canWrite));
  body.addEventListener("pointerdown", (event) => {
    const number = numberAt(body, event.target);
    const spot = number && spotOf(app, number);
    if (number === null || spot === null || event.button !== 0) return;
    event.preventDefault();
    drag(app, spot, event.clientX);
  });
  body.addEventListener("keydown", (event) => {
    const number = event.key === "Enter" ? numberAt(body, event.target) : null;
    const spot = number && spotOf(app, number);
    if (number === null || spot === null) return;
    event.preventDefault();
    event.stopPropagation();
    typeIn(app, number, spot);
  });
  body.addEventListener("dblclick", (event) => {
    const number = numberAt(body, event.target);
    const spot = number && spotOf(app, number);
    if (number !== null && spot !== null) typeIn(app, number, spot);
  });
}

/** The numbers of a line. */
export function numbersOf(row: Element): HTMLElement[] {
  return [...row.querySelectorAll<HTMLElement>(".t-number")];
}

/** Makes a number focusable by the keyboard, or not. Enter edits it. */
export function offer(number: HTMLElement, reached: boolean): void {
  if (reached === number.hasAttribute("tabindex")) return;
  const all = { tabindex: "0", role: "button", "aria-label": `Change ${number.textContent}` };
  for (const [name, value] of Object.entries(all)) {
    if (reached) number.setAttribute(name, value);
    else number.removeAttribute(name);
  }
}

/** Returns a function that focuses the same number again after the text was replaced. */
export function keepFocus(body: HTMLElement): () => void {
  const row = body.contains(document.activeElement)
    ? document.activeElement!.closest<HTMLElement>(".line")
    : null;
  if (row === null) return () => undefined;
  const index = numbersOf(row).indexOf(document.activeElement as HTMLElement);
  return () => {
    const newRow = body.querySelector(`.line[data-line="${row.dataset["line"] ?? ""}"]`);
    (newRow === null ? undefined : numbersOf(newRow)[index])?.focus({ preventScroll: true });
  };
}

function numberAt(body: HTMLElement, target: EventTarget | null): HTMLElement | null {
  return body.classList.contains("editable") &&
    target instanceof HTMLElement &&
    target.classList.contains("t-number")
    ? target
    : null;
}

function spotOf(app: App, number: HTMLElement): Spot | null {
  const row = number.closest<HTMLElement>(".line");
  const text = number.closest<HTMLElement>(".text");
  const file = app.spot.value?.place.file;
  if (row === null || text === null || file === undefined) return null;
  const before = document.createRange();
  before.setStart(text, 0);
  before.setEndBefore(number);
  return {
    file,
    line: Number(row.dataset["line"]),
    column: Array.from(before.toString()).length + 1,
    was: number.textContent,
  };
}

function drag(app: App, spot: Spot, from: number): void {
  const move = (event: PointerEvent): void => {
    const steps = Math.round((event.clientX - from) / PIXELS_A_STEP);
    put(app, spot, stepped(start, steps));
  };
  const end = (): void => {
    removeEventListener("pointermove", move);
    removeEventListener("pointerup", end);
    removeEventListener("pointercancel", end);
  };
  const start = spot.was;
  addEventListener("pointermove", move);
  addEventListener("pointerup", end);
  addEventListener("pointercancel", end);
}

function typeIn(app: App, number: HTMLElement, spot: Spot): void {
  const field = h("input", { class: "edit", value: spot.was, "aria-label": `Change ${spot.was}` });
  number.replaceWith(field);
  field.select();
  field.focus();
  let over = false;
  const done = (keep: boolean): void => {
    if (over) return;
    over = true;
    const text = field.value.trim();
    field.replaceWith(number);
    if (!keep || text === "") return;
    if (isValue(text)) put(app, spot, text);
    else
      app.refused.set({
        reason: `'${text}' is not a number and contains no \${…}. The value is still ${spot.was}.`,
      });
  };
  field.addEventListener("blur", () => done(true));
  field.addEventListener("keydown", (event) => {
    event.stopPropagation();
    if (event.key === "Enter") done(true);
    if (event.key === "Escape") done(false);
    if (over) number.focus({ preventScroll: true });
  });
}

/** Replaces the text at a spot in the file. */
function put(app: App, spot: Spot, text: string): void {
  if (text === spot.was) return;
  app.send({
    type: "edit_source",
    file: spot.file,
    line: spot.line,
    column: spot.column,
    was: spot.was,
    text,
  });
  spot.was = text;
}

/** Whether a text is valid in place of a number: a number or an expression. */
export function isValue(text: string): boolean {
  if (/\$\{[^}]+\}|\$\([^)]+\)/.test(text)) return true;
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(text) && Number.isFinite(Number(text));
}

/** A number changed by steps of its last digit, with the same decimals. One with an exponent changes by percent. */
export function stepped(text: string, steps: number): string {
  const digits = /\.(\d*)/.exec(text)?.[1]?.length ?? 0;
  if (/e/i.test(text)) return String(Number((Number(text) * (1 + steps / 100)).toPrecision(4)));
  return (Number(text) + steps * 10 ** -digits).toFixed(digits);
}
