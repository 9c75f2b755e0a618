import { closeBrackets, closeBracketsKeymap, completionKeymap } from "@codemirror/autocomplete";
import {
  defaultKeymap,
  indentWithTab,
  isolateHistory,
  redo,
  redoDepth,
  undo,
  undoDepth,
} from "@codemirror/commands";
import { xmlLanguage } from "@codemirror/lang-xml";
import { bracketMatching, indentOnInput, indentUnit } from "@codemirror/language";
import { highlightSelectionMatches, search, searchKeymap } from "@codemirror/search";
import { Annotation, EditorState, Prec, Transaction, type Extension } from "@codemirror/state";
import {
  drawSelection,
  EditorView,
  highlightActiveLine,
  highlightActiveLineGutter,
  highlightSpecialChars,
  keymap,
  lineNumbers,
} from "@codemirror/view";

import type { App, Spot } from "../app";
import type { SourceText, TextEdit } from "../protocol";
import css from "../style/editor.css?inline";
import { colours } from "./colours";
import { completion } from "./complete";
import { marks, ownersAt, setKnown, setMarked } from "./marks";
import { numbers } from "./numbers";
import { changesOf, changesTo, offsetAt, separatorOf } from "./positions";
import { markProblems, problems } from "./problems";
import { afterChange, typedHistory } from "./typed-history";

/** Marks a change that the user did not make: the text of the file. */
const fromFile = Annotation.define<boolean>();

/** What the buttons of the source panel can do. */
export interface Editor {
  undo(): void;
  redo(): void;
  /** Whether there is something to undo and to redo. */
  readonly history: { undo: boolean; redo: boolean };
}

/** Creates the text editor of the source panel, in its own shadow root: the page's content security policy allows only
 * style sheets of the server, and CodeMirror adds its own only to a shadow root without a `<style>` element. */
export function createEditor(app: App, host: HTMLElement, leave: () => void, changed: () => void): Editor {
  const root = host.attachShadow({ mode: "open" });
  const sheet = new CSSStyleSheet();
  sheet.replaceSync(css);
  root.adoptedStyleSheets = [sheet];
  return new SourceEditor(app, root, leave, changed);
}

class SourceEditor implements Editor {
  private readonly view: EditorView;
  private readonly states = new Map<string, EditorState>();
  /** The message of each file that was shown last. */
  private readonly shown = new Map<string, SourceText>();
  /** Files whose last change was made by the server, so that it is the server that undoes it. */
  private readonly changedByServer = new Set<string>();
  private file = "";
  private lastSpot: Spot | null = null;
  private waitingEdits: readonly TextEdit[] | null = null;

  constructor(
    private readonly app: App,
    root: ShadowRoot,
    private readonly leave: () => void,
    private readonly changed: () => void,
  ) {
    this.view = new EditorView({ root, parent: root });
    const draw = (): void => this.draw();
    for (const signal of [app.spot, app.sources, app.selected, app.about]) signal.watch(draw);
    for (const signal of [app.findings, app.drafts.findings, app.drafts.files])
      signal.watch(() => this.markProblems());
    app.drafts.replaced.watch((now) => now !== null && this.replace(now.file, now.text, now.isChosen));
    app.drafts.edits.watch((edits) => edits !== null && this.apply(edits));
    app.parameters.watch(changed);
  }

  get history(): { undo: boolean; redo: boolean } {
    const { state } = this.view;
    const { value: server } = this.app.parameters;
    return {
      undo: undoDepth(state) > 0 || Boolean(server?.undo),
      redo: redoDepth(state) > 0 || Boolean(server?.redo),
    };
  }

  undo(): void {
    this.step("undo", undoDepth(this.view.state), undo);
  }

  redo(): void {
    this.step("redo", redoDepth(this.view.state), redo);
  }

  /** Undoes or redoes the last change: in the text, or in the file if the page has changed that last. */
  private step(type: "undo" | "redo", depth: number, command: (view: EditorView) => boolean): void {
    const isSaved = !this.app.drafts.files.value.has(this.file);
    const isServers = isSaved && (depth === 0 || this.changedByServer.has(this.file));
    if (isServers && this.app.parameters.value?.[type]) this.app.send({ type });
    else command(this.view);
  }

  /** Handles Ctrl+Z with and without Shift. A key binding would take Shift for Caps Lock if the key is a small letter. */
  private stepByKeys(event: KeyboardEvent): boolean {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || event.key.toLowerCase() !== "z") return false;
    if (event.shiftKey) this.redo();
    else this.undo();
    return true;
  }

  private draw(): void {
    const { spot, sources, selected } = this.app;
    if (spot.value === null) {
      this.lastSpot = null;
      return;
    }
    const { place } = spot.value;
    const source = sources.value.get(place.file);
    for (const [file, text] of sources.value) this.take(file, text);
    if (source === undefined && !this.states.has(place.file) && place.file !== this.file) return;
    this.open(place.file);
    if (this.waitingEdits?.every(({ file }) => this.stateOf(file) !== undefined))
      this.apply(this.waitingEdits);
    this.view.dispatch({ effects: setMarked.of({ spot: spot.value, link: selected.value }) });
    this.markProblems();
    if (this.lastSpot === spot.value) return; // an edit elsewhere must not scroll the text
    this.lastSpot = spot.value;
    if (spot.value.scrolls) {
      const at = offsetAt(this.view.state.doc, place.line, place.column);
      this.view.dispatch({
        selection: { anchor: at },
        effects: EditorView.scrollIntoView(at, { y: "center" }),
      });
    }
    if (spot.value.takesFocus) this.view.focus();
  }

  /** Shows the text of a file that was opened before. */
  private open(file: string): void {
    if (file === this.file) return;
    if (this.file !== "") this.states.set(this.file, this.view.state);
    this.file = file;
    this.view.setState(this.states.get(file)!);
    this.states.delete(file);
    this.changed();
  }

  /** Takes a text from the server, unless it was taken before. */
  private take(file: string, source: SourceText): void {
    if (this.shown.get(file) === source) return;
    this.shown.set(file, source);
    const isSaved = this.app.drafts.read(file, source.text);
    const state = this.stateOf(file);
    if (state === undefined) this.states.set(file, this.created(source));
    else if (isSaved && this.replace(file, source.text, false)) this.changedByServer.add(file);
    const now = this.stateOf(file)!;
    if (now.sliceDoc() === source.text) this.update(file, now.update({ effects: setKnown.of(source) }));
  }

  private stateOf(file: string): EditorState | undefined {
    return file === this.file ? this.view.state : this.states.get(file);
  }

  private update(file: string, transaction: Transaction): void {
    if (file === this.file) this.view.dispatch(transaction);
    else this.states.set(file, transaction.state);
  }

  /** Replaces the text of a file by that on disk. The cursor stays in its line and column. Returns whether it differs.
   * Only a text that the user has chosen can be undone. */
  private replace(file: string, text: string, isChosen: boolean): boolean {
    const state = this.stateOf(file);
    const changes = state === undefined ? [] : changesTo(state, text);
    if (state === undefined || changes.length === 0) return false;
    const { head } = state.selection.main;
    const line = state.doc.lineAt(head);
    const annotations = [
      fromFile.of(true),
      Transaction.addToHistory.of(isChosen),
      isolateHistory.of("full"), // else it joins what was typed within half a second, and undoing removes both
    ];
    let transaction = state.update({ changes, annotations });
    if (changes.some(({ from, to }) => from < head && head < to)) {
      const { doc } = transaction.state;
      const row = doc.line(Math.min(line.number, doc.lines));
      const anchor = Math.min(row.from + head - line.from, row.to);
      transaction = state.update({ changes, selection: { anchor }, annotations });
    }
    this.update(file, transaction);
    if (!isChosen)
      for (const spec of afterChange(transaction)) this.update(file, this.stateOf(file)!.update(spec));
    this.changed();
    return true;
  }

  /** Applies edits to the texts of their files, when all of them have been read. */
  private apply(edits: readonly TextEdit[]): void {
    const files = new Set(edits.map(({ file }) => file));
    const missing = [...files].filter((file) => this.stateOf(file) === undefined);
    this.waitingEdits = missing.length > 0 ? edits : null;
    for (const file of missing) this.app.send({ type: "open_source", file });
    if (missing.length > 0) return;
    for (const file of files) {
      const state = this.stateOf(file)!;
      if (state.readOnly) continue;
      const changes = changesOf(
        state.doc,
        edits.filter((edit) => edit.file === file),
      );
      this.update(file, state.update({ changes, userEvent: "input.fix" }));
      if (file !== this.file) this.app.drafts.edit(file, this.stateOf(file)!.sliceDoc());
    }
  }

  private markProblems(): void {
    if (this.file !== "") this.view.dispatch(markProblems(this.app, this.view.state, this.file));
  }

  private created(source: SourceText): EditorState {
    const isReadOnly = !this.app.canWrite || source.read_only !== "";
    return EditorState.create({
      doc: source.text,
      extensions: [
        EditorState.lineSeparator.of(separatorOf(source.text)),
        EditorState.readOnly.of(isReadOnly),
        EditorView.editorAttributes.of({ class: isReadOnly ? "read-only" : "writable" }),
        this.extensions(),
      ],
    });
  }

  private extensions(): Extension {
    const { app } = this;
    const file = (): string => this.file;
    return [
      keymap.of([
        { key: "Mod-s", run: () => (app.save(this.file), true), preventDefault: true },
        { key: "Mod-y", run: () => (this.redo(), true), preventDefault: true },
      ]),
      Prec.high(EditorView.domEventHandlers({ keydown: (event) => this.stepByKeys(event) })),
      numbers(app, file),
      lineNumbers(),
      problems(app, file),
      highlightSpecialChars(),
      typedHistory,
      drawSelection(),
      indentOnInput(),
      indentUnit.of("  "),
      EditorState.tabSize.of(4),
      bracketMatching(),
      closeBrackets(),
      highlightActiveLine(),
      highlightActiveLineGutter(),
      highlightSelectionMatches(),
      search({ top: true }),
      xmlLanguage,
      colours,
      marks,
      completion(() => app.drafts.completions.value),
      keymap.of([
        ...closeBracketsKeymap,
        ...completionKeymap,
        ...searchKeymap,
        ...defaultKeymap,
        indentWithTab,
        { key: "Escape", run: () => (this.leave(), true) },
      ]),
      EditorView.contentAttributes.of({ "aria-label": "Source text", tabindex: "0" }),
      EditorView.clipboardInputFilter.of((text, state) => text.replace(/\r\n?|\n/g, state.lineBreak)),
      EditorView.domEventHandlers({ click: (event, view) => this.chooseOwner(event, view) }),
      EditorView.updateListener.of((update) => {
        if (!update.docChanged) return;
        if (!update.transactions.some((transaction) => transaction.annotation(fromFile))) {
          this.changedByServer.delete(this.file);
          app.drafts.edit(this.file, update.state.sliceDoc());
        }
        this.changed();
      }),
    ];
  }

  /** Selects the link of a line. Repeated clicks on a line with several links select each in turn. */
  private chooseOwner(event: MouseEvent, view: EditorView): void {
    const at = view.posAtCoords({ x: event.clientX, y: event.clientY });
    if (at === null || !view.state.selection.main.empty || event.detail > 1) return;
    const owners = ownersAt(view.state, at);
    const { selected } = this.app;
    if (owners.length > 0) selected.set(owners[(owners.indexOf(selected.value) + 1) % owners.length] ?? "");
  }
}
