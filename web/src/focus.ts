/** Whether what has the focus got it by the keyboard, so that keys are meant for it. */
let byKeyboard = true;

/** A click leaves the keys with the robot: only fields to write in keep the focus that a pointer gave. */
export function keepKeysForDriving(): void {
  addEventListener("pointerdown", () => (byKeyboard = false), true);
  addEventListener("keydown", (event) => event.key === "Tab" && (byKeyboard = true), true);
  addEventListener(
    "click",
    (event) => {
      const focused = document.activeElement;
      const byPointer = event.detail > 0;
      // a list that is just opening would close
      if (byPointer && focused instanceof HTMLElement && !isField(focused) && !(focused instanceof HTMLSelectElement)) focused.blur();
    },
    true,
  );
}

/** Whether one writes text or a number there. */
export function isField(target: EventTarget | null): boolean {
  if (target instanceof HTMLInputElement) return !["button", "checkbox", "range"].includes(target.type);
  return target instanceof HTMLTextAreaElement || (target instanceof HTMLElement && target.isContentEditable);
}

/** What moves a slider: all other keys go to the page. */
const SLIDES: readonly string[] = ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"];

/** Whether a key belongs to where it is pressed: to a field, or to a slider or list one came to by keys. */
export function takesKeys({ target, key }: KeyboardEvent): boolean {
  if (isField(target)) return true;
  if (!byKeyboard) return false;
  return target instanceof HTMLSelectElement || (target instanceof HTMLInputElement && target.type === "range" && SLIDES.includes(key));
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
