import type { Bookmark } from "../protocol";
import { Signal } from "../signal";

/** The bookmarks of the run, which the server keeps, in the order of their moments. */
export class Bookmarks {
  readonly all = new Signal<readonly Bookmark[]>([]);

  /** The nearest one before or after a moment, of those that can be gone to. */
  next(at: number, direction: 1 | -1, start: number): Bookmark | undefined {
    const beyond = this.all.value.filter((one) => one.at >= start && (one.at - at) * direction > 1e-3);
    return direction > 0 ? beyond[0] : beyond.at(-1);
  }
}
