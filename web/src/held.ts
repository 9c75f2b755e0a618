/** Milliseconds after a hand's or a key's last move. */
const HELD = 400;

/**
 * Whether a slider is to stay where it was put: what is told of meanwhile may be from before. `settle` is called
 * when that is over.
 */
export function held(slider: HTMLInputElement, settle: () => void): () => boolean {
  let moved = -Infinity;
  let over: ReturnType<typeof setTimeout> | undefined;
  const touch = (): void => {
    moved = performance.now();
    clearTimeout(over);
    over = setTimeout(settle, HELD + 1);
  };
  slider.addEventListener("input", touch);
  slider.addEventListener("change", touch);
  return () => slider.matches(":active") || performance.now() < moved + HELD;
}
