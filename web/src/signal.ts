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
  watchAtLeisure(listener: (value: T) => void, apart = 100): void {
    let told = -Infinity;
    let waits = false;
    const tell = (): void => {
      waits = false;
      told = performance.now();
      listener(this.current);
    };
    this.watch(() => {
      if (waits) return;
      const wait = told + apart - performance.now();
      if (wait <= 0) return tell();
      waits = true;
      setTimeout(tell, wait);
    });
  }
}
