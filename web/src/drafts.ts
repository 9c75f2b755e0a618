import type {
  Completions,
  Finding,
  FromPage,
  SourceConflict,
  SourceSaved,
  TextEdit,
  TextsChecked,
} from "./protocol";
import { Signal } from "./signal";

/** Milliseconds after a change until the texts are checked. */
const CHECK_AFTER = 250;

/** The unsaved text of a file. `base` is the content of the file that the text was made from. */
export interface Draft {
  base: string;
  text: string;
  /** Whether another program has changed the file since. */
  isOutdated: boolean;
}

/** The unsaved texts of the source panel, and what the server finds in them. */
export class Drafts {
  /** The unsaved texts by file. */
  readonly files = new Signal<ReadonlyMap<string, Draft>>(new Map());
  /** The findings of the unsaved texts, null if there is no unsaved text or it is not checked yet. */
  readonly findings = new Signal<readonly Finding[] | null>(null);
  readonly completions = new Signal<Completions | null>(null);
  /** A file that could not be saved, because another program changed the same lines or deleted it. */
  readonly conflict = new Signal<SourceConflict | null>(null);
  /** A text that the editor must show now, and whether the user chose it instead of the own text. */
  readonly replaced = new Signal<{ file: string; text: string; isChosen: boolean } | null>(null);
  /** Edits that the editor must apply to its texts. */
  readonly edits = new Signal<readonly TextEdit[] | null>(null);
  /** The content of each file when the editor last showed it without changes. */
  private readonly bases = new Map<string, string>();
  private number = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;

  constructor(private readonly send: (message: FromPage) => void) {}

  get isEmpty(): boolean {
    return this.files.value.size === 0;
  }

  /** Takes the content of a file on disk. Returns whether the editor should show it: it has no unsaved text. */
  read(file: string, content: string): boolean {
    const draft = this.files.value.get(file);
    if (this.isDeleted(file)) this.conflict.set(null); // the file exists again
    if (draft === undefined || draft.text === content) {
      this.bases.set(file, content);
      this.set(file, null);
      return true;
    }
    if (content !== draft.base && !draft.isOutdated) this.set(file, { ...draft, isOutdated: true });
    return false;
  }

  /** Takes the text that the user has typed. */
  edit(file: string, text: string): void {
    const base = this.bases.get(file) ?? "";
    const isOutdated = this.files.value.get(file)?.isOutdated ?? false;
    this.set(file, text === base ? null : { base, text, isOutdated });
    if (text === base && isOutdated) this.send({ type: "open_source", file });
  }

  /** Whether another program has deleted the file. */
  isDeleted(file: string): boolean {
    const { value } = this.conflict;
    return value?.file === file && value.text === null;
  }

  /** The files that can be saved: those with an unsaved text, and one that was deleted while its text is in the editor. */
  get toSave(): ReadonlySet<string> {
    const deleted = this.conflict.value?.file ?? "";
    const canRestore = this.isDeleted(deleted) && this.bases.has(deleted);
    return new Set([...this.files.value.keys(), ...(canRestore ? [deleted] : [])]);
  }

  /** Saves the text of a file, or creates the file again if it was deleted. */
  save(file: string): void {
    const draft = this.files.value.get(file);
    const text = draft?.text ?? this.bases.get(file);
    if (this.isDeleted(file) && text !== undefined) this.send({ type: "save_source", file, was: null, text });
    else if (draft !== undefined) this.send({ type: "save_source", file, was: draft.base, text: draft.text });
  }

  saved({ file, sent, text }: SourceSaved): void {
    const draft = this.files.value.get(file);
    if (this.conflict.value?.file === file) this.conflict.set(null);
    if (draft === undefined) return;
    if (draft.text === sent) {
      this.bases.set(file, text);
      this.set(file, null);
      this.replaced.set({ file, text, isChosen: false });
    } else {
      // typed on since: the next save merges the changes of other programs again
      this.bases.set(file, sent);
      this.set(file, { base: sent, text: draft.text, isOutdated: text !== sent });
    }
  }

  /** Writes the text of the page over the changes of the other program. */
  keepMine(): void {
    const { value } = this.conflict;
    const draft = value === null ? undefined : this.files.value.get(value.file);
    this.conflict.set(null);
    if (value?.text == null || draft === undefined) return;
    this.bases.set(value.file, value.text);
    this.set(value.file, { base: value.text, text: draft.text, isOutdated: false });
    this.send({ type: "save_source", file: value.file, was: value.text, text: draft.text });
  }

  /** Replaces the text of the page by the file. The editor can undo it. */
  takeTheirs(): void {
    const { value } = this.conflict;
    this.conflict.set(null);
    if (value?.text == null) return;
    this.bases.set(value.file, value.text);
    this.set(value.file, null);
    this.replaced.set({ file: value.file, text: value.text, isChosen: true });
  }

  checked({ number, findings, completions }: TextsChecked): void {
    if (completions !== null) this.completions.set(completions);
    if (number === this.number && !this.isEmpty) this.findings.set(findings);
  }

  /** Checks the unsaved texts again, after a while without changes. */
  check(): void {
    clearTimeout(this.timer);
    if (!this.isEmpty) this.timer = setTimeout(() => this.request(), CHECK_AFTER);
  }

  private request(): void {
    this.number += 1;
    const { value: files } = this.files;
    this.send({
      type: "check_texts",
      number: this.number,
      files: [...files.keys()],
      texts: [...files.values()].map(({ text }) => text),
    });
  }

  private set(file: string, draft: Draft | null): void {
    const files = new Map(this.files.value);
    if (draft === null && this.conflict.value?.file === file && !this.isDeleted(file))
      this.conflict.set(null);
    if (draft !== null) files.set(file, draft);
    else if (!files.delete(file)) return;
    this.files.set(files);
    if (files.size === 0) this.findings.set(null);
    this.check();
  }
}
