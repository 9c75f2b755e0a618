import { ensureSyntaxTree, syntaxTree } from "@codemirror/language";
import type { Extension } from "@codemirror/state";
import { EditorView, keymap } from "@codemirror/view";

import type { App } from "../app";
import { h } from "../dom";
import { piecesOf } from "./colours";
import { columnAt } from "./positions";

/** Pixels of a drag that change the last digit by 1. */
const PIXELS_A_STEP = 6;

/** Milliseconds that a key press may wait until the text is parsed up to the cursor. */
const PARSE_WITHIN = 200;

/** A number in a file, and its text. */
interface Spot {
  file: string;
  from: number;
  was: string;
}

/** Lets the user drag numbers sideways, edit them after a double click, or step them by keys. */
export function numbers(app: App, file: () => string): Extension {
  const clicked = (view: EditorView, target: EventTarget | null): Spot | null =>
    target instanceof HTMLElement && target.closest(".t-number") !== null
      ? numberAt(view, view.posAtDOM(target), file())
      : null;
  const step =
    (steps: number) =>
    (view: EditorView): boolean => {
      const spot = numberAt(view, view.state.selection.main.head, file());
      if (spot !== null) put(app, view, spot, stepped(spot.was, steps));
      return spot !== null;
    };
  return [
    EditorView.domEventHandlers({
      mousedown(event, view) {
        const spot = event.button === 0 ? clicked(view, event.target) : null;
        if (spot === null || event.shiftKey) return false;
        event.preventDefault();
        if (event.detail === 1) drag(app, view, spot, event);
        return true;
      },
      dblclick(event, view) {
        const spot = clicked(view, event.target);
        if (spot !== null) typeIn(app, view, spot);
        return spot !== null;
      },
    }),
    keymap.of([
      { key: "Ctrl-ArrowUp", run: step(1) },
      { key: "Ctrl-ArrowDown", run: step(-1) },
    ]),
  ];
}

/** The number at an offset, null if there is none or it cannot be changed. */
function numberAt(view: EditorView, offset: number, file: string): Spot | null {
  const { doc, readOnly } = view.state;
  if (readOnly) return null;
  const line = doc.lineAt(offset);
  const tree = ensureSyntaxTree(view.state, line.to, PARSE_WITHIN) ?? syntaxTree(view.state);
  const found = piecesOf(tree, doc, line.from, line.to).find(
    ({ from, to, style }) => style === "t-number" && from <= offset && offset <= to,
  );
  return found === undefined ? null : { file, from: found.from, was: doc.sliceString(found.from, found.to) };
}

/** Changes a number while the pointer moves. A press without a move sets the cursor. */
function drag(app: App, view: EditorView, spot: Spot, press: MouseEvent): void {
  const start = spot.was;
  let moved = false;
  const move = (event: PointerEvent): void => {
    const steps = Math.round((event.clientX - press.clientX) / PIXELS_A_STEP);
    moved ||= steps !== 0;
    if (moved) put(app, view, spot, stepped(start, steps));
  };
  const end = (): void => {
    removeEventListener("pointermove", move);
    removeEventListener("pointerup", end);
    removeEventListener("pointercancel", end);
    if (moved) return;
    view.dispatch({ selection: { anchor: view.posAtCoords({ x: press.clientX, y: press.clientY }, false) } });
    view.focus();
  };
  addEventListener("pointermove", move);
  addEventListener("pointerup", end);
  addEventListener("pointercancel", end);
}

function typeIn(app: App, view: EditorView, spot: Spot): void {
  const field = h("input", { class: "edit", value: spot.was, "aria-label": `Change ${spot.was}` });
  const at = view.coordsAtPos(spot.from);
  const around = view.dom.getBoundingClientRect();
  field.style.left = `${(at?.left ?? 0) - around.left}px`;
  field.style.top = `${(at?.top ?? 0) - around.top}px`;
  view.dom.append(field);
  field.select();
  field.focus();
  let over = false;
  const done = (keep: boolean): void => {
    if (over) return;
    over = true;
    const text = field.value.trim();
    field.remove();
    if (!keep || text === "") return;
    if (isValue(text)) put(app, view, spot, text);
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
  });
}

/** Replaces a number in the unsaved text, or in the file if there is no unsaved text. */
function put(app: App, view: EditorView, spot: Spot, text: string): void {
  const { file, from, was } = spot;
  if (text === was) return;
  const { doc } = view.state;
  if (app.drafts.files.value.has(file))
    view.dispatch({ changes: { from, to: from + was.length, insert: text }, userEvent: "input" });
  else
    app.send({
      type: "edit_source",
      file,
      line: doc.lineAt(from).number,
      column: columnAt(doc, from),
      was,
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
