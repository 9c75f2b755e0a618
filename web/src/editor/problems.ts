import { lintGutter, lintKeymap, setDiagnostics, type Diagnostic } from "@codemirror/lint";
import type { EditorState, Extension, Text, TransactionSpec } from "@codemirror/state";
import { keymap, type EditorView } from "@codemirror/view";

import type { App } from "../app";
import { h } from "../dom";
import type { Finding } from "../protocol";
import { rangeOf } from "./positions";

/** Findings that are marked in the text. A text with more is marked only up to there. */
const MOST_MARKED = 500;

/** Marks the findings of a file in its text. */
export function markProblems(app: App, state: EditorState, file: string): TransactionSpec {
  const found = app.shownFindings.filter(({ place }) => place?.file === file).slice(0, MOST_MARKED);
  return setDiagnostics(
    state,
    found.map((finding) => diagnosticOf(app, finding, state.doc, !state.readOnly)),
  );
}

function diagnosticOf(app: App, finding: Finding, doc: Text, canFix: boolean): Diagnostic {
  const { code, severity, message, hint, fix } = finding;
  return {
    ...rangeOf(doc, finding.place!),
    severity,
    message: hint === "" ? message : `${message}\n${hint}`,
    source: code,
    renderMessage: () =>
      h(
        "div",
        {},
        message,
        h("span", { class: "problem-code" }, ` ${code}`),
        hint !== "" && h("div", { class: "problem-hint" }, hint),
      ),
    ...(fix !== "" && canFix ? { actions: [{ name: fix, apply: () => app.applyFix(finding) }] } : {}),
  };
}

/** Applies the fix of the finding at the cursor, or else of one in its line. */
function applyFixAtCursor(app: App, file: () => string, view: EditorView): boolean {
  const { doc, selection } = view.state;
  const at = selection.main.head;
  const fixable = app.shownFindings
    .filter(({ place, fix }) => place?.file === file() && fix !== "")
    .map((finding) => ({ finding, ...rangeOf(doc, finding.place!) }))
    .filter(({ from }) => doc.lineAt(from).number === doc.lineAt(at).number);
  const best = fixable.find(({ from, to }) => from <= at && at <= to) ?? fixable[0];
  if (best === undefined || view.state.readOnly) return false;
  app.applyFix(best.finding);
  return true;
}

/** Squiggles, marks in the gutter, and keys for findings. */
export function problems(app: App, file: () => string): Extension {
  return [
    lintGutter(),
    keymap.of([{ key: "Mod-.", run: (view) => applyFixAtCursor(app, file, view) }, ...lintKeymap]),
  ];
}
