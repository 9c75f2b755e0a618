/** Milliseconds for which a slider stays put after its last move. */
const HELD = 400;

/**
 * Returns a function that reports whether the user holds a slider. Until then values from the server must not move it,
 * because they may be older than the user's move. `settle` is called when the hold ends.
 */
export function sliderHold(slider: HTMLInputElement, settle: () => void): () => boolean {
  let moved = -Infinity;
  let timer: ReturnType<typeof setTimeout> | undefined;
  const touch = (): void => {
    moved = performance.now();
    clearTimeout(timer);
    timer = setTimeout(settle, HELD + 1);
  };
  slider.addEventListener("input", touch);
  slider.addEventListener("change", touch);
  return () => slider.matches(":active") || performance.now() < moved + HELD;
}
