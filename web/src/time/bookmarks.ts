import { Signal } from "../signal";

/** A moment that was marked, in seconds along the timeline, and what was noted of it. */
export interface Bookmark {
  at: number;
  /** Simulated time there. */
  time: number;
  note: string;
}

/** The bookmarks of this page, in the order of their moments. */
export class Bookmarks {
  readonly all = new Signal<readonly Bookmark[]>([]);

  add(at: number, time: number): void {
    const names = new Set(this.all.value.map(({ note }) => note));
    let number = 1;
    while (names.has(`Bookmark ${number}`)) number += 1;
    this.set([...this.all.value, { at, time, note: `Bookmark ${number}` }]);
  }

  note(one: Bookmark, note: string): void {
    this.set(this.all.value.map((other) => (other === one ? { ...one, note } : other)));
  }

  remove(one: Bookmark): void {
    this.set(this.all.value.filter((other) => other !== one));
  }

  /** The nearest one before or after a moment. */
  next(at: number, direction: 1 | -1): Bookmark | undefined {
    const beyond = this.all.value.filter((one) => (one.at - at) * direction > 1e-3);
    return direction > 0 ? beyond[0] : beyond.at(-1);
  }

  /** Forgets what is before or after all there is. */
  keepWithin(start: number, end: number): void {
    const kept = this.all.value.filter(({ at }) => at >= start && at <= end);
    if (kept.length < this.all.value.length) this.set(kept);
  }

  private set(all: Bookmark[]): void {
    this.all.set(all.sort((a, b) => a.at - b.at));
  }
}
