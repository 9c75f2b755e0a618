/** Whether what has the focus got it by the keyboard, so that keys are meant for it. */
let byKeyboard = true;

/**
 * A click leaves the keys with the robot: only fields to write in and sliders keep the focus that a pointer gave.
 * Arrows after a drag move the slider on, never the robot; a press anywhere else gives them back.
 */
export function keepKeysForDriving(): void {
  addEventListener(
    "pointerdown",
    ({ target }) => {
      byKeyboard = false;
      const focused = document.activeElement;
      if (isSlider(target))
        target.focus(); // not every browser does
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
      // a list that is just opening would close
      if (byPointer && focused instanceof HTMLElement && !keepsFocus(focused)) focused.blur();
    },
    true,
  );
}

/** Whether one writes text or a number there. */
export function isField(target: EventTarget | null): boolean {
  if (target instanceof HTMLInputElement) return !["button", "checkbox", "range"].includes(target.type);
  return target instanceof HTMLTextAreaElement || (target instanceof HTMLElement && target.isContentEditable);
}

/** Takes the arrows from a slider that a pointer gave them. */
export function leaveSlider(): void {
  const focused = document.activeElement;
  if (isSlider(focused)) letGo(focused);
}

/** Whether it is still meant once the pointer has left it. */
function keepsFocus(element: HTMLElement): boolean {
  return isField(element) || element instanceof HTMLSelectElement || isSlider(element);
}

function isSlider(target: EventTarget | null): target is HTMLElement {
  return target instanceof HTMLElement && target.matches("input[type=range], [role=slider]");
}

/** What moves a slider: all other keys go to the page. */
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

/** Whether a key belongs to where it is pressed: to a field, to a slider, or to a list one came to by keys. */
export function takesKeys({ target, key }: KeyboardEvent): boolean {
  if (isField(target)) return true;
  if (isSlider(target)) return SLIDES.includes(key);
  return byKeyboard && target instanceof HTMLSelectElement;
}

/** Whether Space presses it. */
export function answersToSpace(target: EventTarget | null): boolean {
  return target instanceof Element && target.matches("button, summary, select, input[type=checkbox]");
}

export function focusedByKeyboard(): boolean {
  return byKeyboard;
}

/** Leaves the keys with the robot after a choice by pointer; who came by keys may go on choosing. */
export function letGo(element: HTMLElement): void {
  if (!byKeyboard) element.blur();
}
