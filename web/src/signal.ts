/** A value with listeners that are called when it changes. */
export class Signal<T> {
  private readonly listeners = new Set<(value: T) => void>();

  constructor(private current: T) {}

  get value(): T {
    return this.current;
  }

  set(value: T): void {
    if (Object.is(value, this.current)) return;
    this.current = value;
    for (const listener of this.listeners) listener(value);
  }

  /** Calls `listener` with the current value and with every later one. Returns a function that stops it. */
  watch(listener: (value: T) => void): () => void {
    this.listeners.add(listener);
    listener(this.current);
    return () => void this.listeners.delete(listener);
  }

  /** Like `watch`, but at most once per `apart` ms, always with the latest value. For text that people read. */
  watchThrottled(listener: (value: T) => void, apart = 100): void {
    let lastCall = -Infinity;
    let isWaiting = false;
    const call = (): void => {
      isWaiting = false;
      lastCall = performance.now();
      listener(this.current);
    };
    this.watch(() => {
      if (isWaiting) return;
      const wait = lastCall + apart - performance.now();
      if (wait <= 0) return call();
      isWaiting = true;
      setTimeout(call, wait);
    });
  }
}
