/** Whether the focused element was focused by the keyboard, so that keys belong to it. */
let byKeyboard = true;

/**
 * Keeps the keys for driving after a click. Only text fields and sliders keep the focus that a pointer gave them.
 * After a drag the arrow keys move the slider, not the robot. A press anywhere else gives them back to the robot.
 */
export function keepKeysForDriving(): void {
  addEventListener(
    "pointerdown",
    ({ target }) => {
      byKeyboard = false;
      const focused = document.activeElement;
      if (isSlider(target))
        target.focus(); // some browsers do not focus a slider on a click
      else if (isSlider(focused)) focused.blur();
    },
    true,
  );
  addEventListener("keydown", (event) => event.key === "Tab" && (byKeyboard = true), true);
  addEventListener(
    "click",
    (event) => {
      const focused = document.activeElement;
      const byPointer = event.detail > 0;
      // blurring an opening list would close it, so lists keep the focus
      if (byPointer && focused instanceof HTMLElement && !keepsFocus(focused)) focused.blur();
    },
    true,
  );
}

/** Whether the target is a field for text or numbers. The text editor counts as one: it is the only shadow root. */
export function isField(target: EventTarget | null): boolean {
  if (target instanceof HTMLInputElement) return !["button", "checkbox", "range"].includes(target.type);
  if (target instanceof HTMLTextAreaElement) return true;
  return target instanceof HTMLElement && (target.isContentEditable || target.shadowRoot !== null);
}

/** Takes the arrow keys away from a slider that was focused by the pointer. */
export function leaveSlider(): void {
  const focused = document.activeElement;
  if (isSlider(focused)) letGo(focused);
}

/** Whether an element keeps the focus after a click. */
function keepsFocus(element: HTMLElement): boolean {
  return isField(element) || element instanceof HTMLSelectElement || isSlider(element);
}

function isSlider(target: EventTarget | null): target is HTMLElement {
  return target instanceof HTMLElement && target.matches("input[type=range], [role=slider]");
}

/** The keys that move a slider. All other keys go to the page. */
const SLIDES: readonly string[] = [
  "ArrowLeft",
  "ArrowRight",
  "ArrowUp",
  "ArrowDown",
  "Home",
  "End",
  "PageUp",
  "PageDown",
];

/** Whether a key belongs to the element it was pressed in: a field, a slider, or a list focused by the keyboard. */
export function takesKeys({ target, key }: KeyboardEvent): boolean {
  if (isField(target)) return true;
  if (isSlider(target)) return SLIDES.includes(key);
  return byKeyboard && target instanceof HTMLSelectElement;
}

/** Whether Space activates the target. */
export function answersToSpace(target: EventTarget | null): boolean {
  return target instanceof Element && target.matches("button, summary, select, input[type=checkbox]");
}

export function focusedByKeyboard(): boolean {
  return byKeyboard;
}

/** Returns the keys to the robot after a choice by pointer. An element focused by the keyboard keeps the focus. */
export function letGo(element: HTMLElement): void {
  if (!byKeyboard) element.blur();
}
