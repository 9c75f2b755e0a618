import { isolateHistory, redo, undo, undoDepth } from "@codemirror/commands";
import { CompletionContext, type CompletionResult } from "@codemirror/autocomplete";
import { completeFromSchema, xmlLanguage } from "@codemirror/lang-xml";
import { EditorState, Text, Transaction, type StateCommand } from "@codemirror/state";
import { describe, expect, it, vi } from "vitest";

import { Drafts } from "../src/drafts";
import { completeName, schemaOf, withinQuotes } from "../src/editor/complete";
import { lineChanges } from "../src/editor/line-diff";
import { changesOf, changesTo, columnAt, offsetAt, separatorOf } from "../src/editor/positions";
import { afterChange, typedHistory } from "../src/editor/typed-history";
import type { Completions, FromPage } from "../src/protocol";

/** The number of lines that are not in the longest common subsequence of two texts. */
function fewestChanged(old: readonly string[], now: readonly string[]): number {
  let row = Array.from({ length: now.length + 1 }, (_, count) => count);
  old.forEach((line, index) => {
    const next = [index + 1];
    now.forEach((other, at) => next.push(line === other ? row[at]! : 1 + Math.min(row[at + 1]!, next[at]!)));
    row = next;
  });
  return row.at(-1)!;
}

describe("line changes", () => {
  it("are the fewest, apart and in order", () => {
    let seed = 1;
    const random = (below: number): number => {
      seed = (seed * 48271) % 2147483647;
      return seed % below;
    };
    const lines = (): string[] => Array.from({ length: random(12) }, () => "abcd"[random(4)]!);
    for (let run = 0; run < 2000; run += 1) {
      const [old, now] = [lines(), lines()];
      const made: string[] = [];
      let [at, count] = [0, 0];
      for (const { fromOld, toOld, fromNew, toNew } of lineChanges(old, now)) {
        if (made.length > 0 || at > 0) expect(fromOld).toBeGreaterThan(at);
        made.push(...old.slice(at, fromOld), ...now.slice(fromNew, toNew));
        at = toOld;
        count += toOld - fromOld + toNew - fromNew;
      }
      expect([...made, ...old.slice(at)]).toEqual(now);
      expect(count).toBe(fewestChanged(old, now));
    }
  });

  it("are one change if they are too many", () => {
    const [old, now] = ["a", "b"].map((name) => Array.from({ length: 600 }, (_, n) => `${name}${n}`));
    expect(lineChanges(old!, now!)).toEqual([{ fromOld: 0, toOld: 600, fromNew: 0, toNew: 600 }]);
  });
});

describe("undo after a change of another program", () => {
  /** A text that the user has changed, and that another program has changed since. */
  function changed(typed: [from: number, to: number, insert: string][], outside: string): EditorState {
    let state = EditorState.create({ doc: "one\ntwo\nthree\n", extensions: typedHistory });
    for (const [from, to, insert] of typed)
      state = state.update({ changes: { from, to, insert }, annotations: isolateHistory.of("full") }).state;
    const annotations = Transaction.addToHistory.of(false);
    const change = state.update({ changes: changesTo(state, outside), annotations });
    ({ state } = change);
    for (const spec of afterChange(change)) ({ state } = state.update(spec));
    return state;
  }

  const after = (state: EditorState, command: StateCommand): EditorState => {
    command({ state, dispatch: (transaction) => ({ state } = transaction) });
    return state;
  };

  it("removes only what the user typed", () => {
    let state = changed([[3, 3, " <!-- A -->"]], "0\none <!-- A -->\ntwo\n3\n");
    state = after(state, undo);
    expect(state.sliceDoc()).toBe("0\none\ntwo\n3\n");
    expect(after(state, redo).sliceDoc()).toBe("0\none <!-- A -->\ntwo\n3\n");
  });

  it.each([
    [
      "typed text was removed",
      [
        [3, 3, "!"],
        [8, 8, "?"],
      ],
      "one\n2\nthree\n",
    ],
    ["replaced text was replaced", [[4, 7, "2"]], "one\n22\nthree\n"],
    ["the line of a deletion was replaced", [[4, 6, ""]], "one\nzwei\nthree\n"],
  ] as [string, [number, number, string][], string][])("does nothing where %s", (_, typed, outside) => {
    const state = changed(typed, outside);
    expect(undoDepth(state)).toBe(0);
    expect(after(state, undo).sliceDoc()).toBe(outside);
  });
});

describe("positions", () => {
  const doc = Text.of(["<a>", 'b="ä😀c"', ""]);

  it.each([
    [1, 1, 0],
    [2, 4, 7],
    [2, 5, 8], // after ä
    [2, 6, 10], // after the emoji, which has two code units
    [2, 99, 12],
    [9, 1, 13],
  ])("line %d, column %d is at offset %d", (line, column, offset) => {
    expect(offsetAt(doc, line, column)).toBe(offset);
  });

  it("count characters in a column", () => {
    expect(columnAt(doc, 10)).toBe(6);
  });

  it.each([
    ["a\r\nb\r\n", "\r\n"],
    ["a\nb\r\n", "\n"],
    ["a\r\nb\rc", "\n"],
    ["\na\r\n", "\n"],
    ["a\nb", "\n"],
    ["", "\n"],
  ])("the lines of %j are separated by %j", (text, separator) => {
    expect(separatorOf(text)).toBe(separator);
    const state = EditorState.create({ doc: text, extensions: EditorState.lineSeparator.of(separator) });
    expect(state.sliceDoc()).toBe(text);
  });

  it.each([
    ["one\ntwo\nthree", "one\n2\nthree"],
    ["aaa", "aa"],
    ["", "x"],
    ["x", ""],
    ["a\r\nb\r\n", "a\r\nc\r\nb\r\n"],
  ])("change %j to %j", (was, now) => {
    const extensions = EditorState.lineSeparator.of(separatorOf(was));
    const state = EditorState.create({ doc: was, extensions });
    expect(state.update({ changes: changesTo(state, now) }).state.sliceDoc()).toBe(now);
    expect(changesTo(state, was)).toEqual([]);
  });

  it("change each line by itself", () => {
    const state = EditorState.create({ doc: "one\ntwo\nthree\nfour\n" });
    expect(changesTo(state, "one!\ntwo\nfour\nfive\n")).toEqual([
      { from: 3, to: 3, insert: "!" },
      { from: 8, to: 14, insert: "" },
      { from: 19, to: 19, insert: "five\n" },
    ]);
  });

  it("apply the edits of a fix", () => {
    const edit = { file: "a", line: 1, column: 2, end_line: 2, end_column: 1, text: "x>\n" };
    const state = EditorState.create({ doc: "<a>\n<b/>" });
    expect(state.update({ changes: changesOf(state.doc, [edit]) }).state.sliceDoc()).toBe("<x>\n<b/>");
  });
});

const COMPLETIONS: Completions = {
  type: "completions",
  elements: [
    { name: "robot", attributes: ["name"], children: ["link"] },
    { name: "link", attributes: ["name"], children: [] },
    { name: "parent", attributes: ["link"], children: [] },
    { name: "xacro:wheel", attributes: ["side"], children: [] },
  ],
  values: [{ element: "parent", attribute: "link", values: ["base"] }],
  properties: [{ name: "radius", value: "0.035" }],
  arguments: [{ name: "lidar", value: "true" }],
};

describe("completion", () => {
  it("offers macros inside every element", () => {
    const [robot, link] = schemaOf(COMPLETIONS);
    expect(robot).toMatchObject({ top: true, children: ["link", "xacro:wheel"] });
    expect(link).not.toHaveProperty("children");
  });

  it.each(['<parent link=""/>', '<parent link="ba"/>'])("offers values between the quotes of %s", (text) => {
    const state = EditorState.create({ doc: text, extensions: [xmlLanguage] });
    const context = new CompletionContext(state, text.length - 3, false);
    const source = completeFromSchema(schemaOf(COMPLETIONS), []);
    const found = withinQuotes(context, source(context) as CompletionResult);
    expect(found).toMatchObject({ from: 14, options: [{ label: "base" }] });
    expect(found?.to).toBeUndefined();
  });

  it.each([
    ['<a b="${ra', ["radius"], 8],
    ['<a b="${2 * ', ["radius"], 12],
    ['<a b="$(arg l', ["lidar"], 12],
  ])("completes the name in %s", (text, labels, from) => {
    const context = new CompletionContext(EditorState.create({ doc: text }), text.length, false);
    const found = completeName(context, COMPLETIONS);
    expect(found?.options.map(({ label }) => label)).toEqual(labels);
    expect(found?.from).toBe(from);
  });

  it.each(['<a b="ra', '<a b="${radius} ', '<a b="${2'])("completes no name in %s", (text) => {
    const context = new CompletionContext(EditorState.create({ doc: text }), text.length, false);
    expect(completeName(context, COMPLETIONS)).toBeNull();
  });
});

describe("drafts", () => {
  function drafts(): { drafts: Drafts; sent: FromPage[] } {
    const sent: FromPage[] = [];
    return { drafts: new Drafts((message) => sent.push(message)), sent };
  }

  it("hold a text until it is saved", () => {
    const { drafts: all, sent } = drafts();
    expect(all.read("a", "old")).toBe(true);
    all.edit("a", "new");
    expect(all.isEmpty).toBe(false);
    all.save("a");
    expect(sent).toEqual([{ type: "save_source", file: "a", was: "old", text: "new" }]);
    all.saved({ type: "source_saved", file: "a", sent: "new", text: "new" });
    expect(all.isEmpty).toBe(true);
  });

  it("are empty again after an undo", () => {
    const { drafts: all } = drafts();
    all.read("a", "old");
    all.edit("a", "new");
    all.edit("a", "old");
    expect(all.isEmpty).toBe(true);
  });

  it("keep the text and the old base when another program changes the file", () => {
    const { drafts: all, sent } = drafts();
    all.read("a", "old");
    all.edit("a", "mine");
    expect(all.read("a", "theirs")).toBe(false);
    expect(all.files.value.get("a")).toEqual({ base: "old", text: "mine", isOutdated: true });
    all.save("a");
    expect(sent.at(-1)).toMatchObject({ was: "old", text: "mine" });
  });

  it("keep what was typed while the text was being saved", () => {
    const { drafts: all } = drafts();
    all.read("a", "old");
    all.edit("a", "sent");
    all.save("a");
    all.edit("a", "sent and more");
    all.saved({ type: "source_saved", file: "a", sent: "sent", text: "sent, merged" });
    expect(all.files.value.get("a")).toEqual({ base: "sent", text: "sent and more", isOutdated: true });
  });

  it("offer both texts after a conflict", () => {
    const { drafts: all, sent } = drafts();
    all.read("a", "old");
    all.edit("a", "mine");
    all.conflict.set({ type: "source_conflict", file: "a", text: "theirs" });
    all.keepMine();
    expect(sent.at(-1)).toMatchObject({ type: "save_source", was: "theirs", text: "mine" });
    all.conflict.set({ type: "source_conflict", file: "a", text: null });
    all.save("a");
    expect(sent.at(-1)).toMatchObject({ type: "save_source", was: null, text: "mine" });
    all.conflict.set({ type: "source_conflict", file: "a", text: "theirs" });
    all.takeTheirs();
    expect(all.isEmpty).toBe(true);
    expect(all.replaced.value).toMatchObject({ file: "a", text: "theirs" });
  });

  it("can be saved when the file was deleted, also without a change", () => {
    const { drafts: all, sent } = drafts();
    all.conflict.set({ type: "source_conflict", file: "a", text: null });
    expect(all.toSave.size).toBe(0); // its text is not known
    all.conflict.set(null);
    all.read("a", "old");
    all.conflict.set({ type: "source_conflict", file: "a", text: null });
    all.edit("a", "new");
    all.edit("a", "old");
    expect([...all.toSave]).toEqual(["a"]);
    all.save("a");
    expect(sent.at(-1)).toMatchObject({ type: "save_source", was: null, text: "old" });
    all.saved({ type: "source_saved", file: "a", sent: "old", text: "old" });
    expect(all.toSave.size).toBe(0);
  });

  it("are checked once after a pause, and an old answer is ignored", () => {
    vi.useFakeTimers();
    const { drafts: all, sent } = drafts();
    all.read("a", "old");
    all.edit("a", "new");
    all.edit("a", "newer");
    vi.runAllTimers();
    expect(sent).toEqual([{ type: "check_texts", number: 1, files: ["a"], texts: ["newer"] }]);
    all.edit("a", "newest");
    vi.runAllTimers();
    all.checked({ type: "texts_checked", number: 1, findings: [], completions: null });
    expect(all.findings.value).toBeNull();
    all.checked({ type: "texts_checked", number: 2, findings: [], completions: null });
    expect(all.findings.value).toEqual([]);
    vi.useRealTimers();
  });
});
