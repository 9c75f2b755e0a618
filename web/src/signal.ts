/** A value and those who want to know when it changes. */
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

  /** Calls `listener` with the present value, and with every later one until the function that is returned is called. */
  watch(listener: (value: T) => void): () => void {
    this.listeners.add(listener);
    listener(this.current);
    return () => void this.listeners.delete(listener);
  }

  /** As `watch`, for what a person reads: no more often than every so many milliseconds, and the newest value always. */
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
