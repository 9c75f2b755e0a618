import type { Bookmark } from "../protocol";
import { Signal } from "../signal";

/** The bookmarks of the run, in order of time. The server stores them. */
export class Bookmarks {
  readonly all = new Signal<readonly Bookmark[]>([]);

  /** The nearest bookmark before or after a time, of those whose time is still stored. */
  next(at: number, direction: 1 | -1, start: number): Bookmark | undefined {
    const beyond = this.all.value.filter(
      (bookmark) => bookmark.at >= start && (bookmark.at - at) * direction > 1e-3,
    );
    return direction > 0 ? beyond[0] : beyond.at(-1);
  }
}
