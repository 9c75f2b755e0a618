import type { Driver } from "./drive-keys";

/** Milliseconds between two reads, as often as commands are sent. */
const EVERY = 50;
/** Deflection below which a stick counts as centred: a stick at rest is never exactly at 0. */
const DEAD = 0.12;

/** Drives the robot with the left stick of a gamepad. */
export function useGamepad(driver: Driver): void {
  let timer: ReturnType<typeof setInterval> | null = null;
  let wasHeld = false;
  const read = (): void => {
    const pad = navigator.getGamepads().find((gamepad) => gamepad !== null);
    const [left, forward] = [steady(-(pad?.axes[0] ?? 0)), steady(-(pad?.axes[1] ?? 0))];
    const held = left !== 0 || forward !== 0;
    if (held || wasHeld) driver.setPad(forward, left);
    wasHeld = held;
  };
  addEventListener("gamepadconnected", () => {
    timer ??= setInterval(read, EVERY);
  });
  addEventListener("gamepaddisconnected", () => {
    if (navigator.getGamepads().some((gamepad) => gamepad !== null)) return;
    if (timer !== null) clearInterval(timer);
    timer = null;
    if (wasHeld) driver.setPad(0, 0);
    wasHeld = false;
  });
}

/** Applies the dead zone. */
export function steady(value: number): number {
  return Math.abs(value) < DEAD ? 0 : value;
}
