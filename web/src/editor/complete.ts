import {
  autocompletion,
  snippet,
  type Completion,
  type CompletionContext,
  type CompletionResult,
  type CompletionSource,
} from "@codemirror/autocomplete";
import { completeFromSchema, type AttrSpec, type ElementSpec } from "@codemirror/lang-xml";
import type { Extension } from "@codemirror/state";

import type { Completions, NamedValue } from "../protocol";

/** Completes elements, attributes and names. */
export function completion(current: () => Completions | null): Extension {
  let known: Completions | null = null;
  let fromSchema: (context: CompletionContext) => CompletionResult | null = () => null;
  const complete: CompletionSource = (context) => {
    const now = current();
    if (now === null) return null;
    if (now !== known) {
      known = now;
      const source = completeFromSchema(schemaOf(now), []);
      fromSchema = (context) => withinQuotes(context, source(context) as CompletionResult | null);
    }
    return completeName(context, now) ?? fromSchema(context);
  };
  return autocompletion({
    override: [complete],
    icons: false,
    activateOnCompletion: ({ type }) => type === "property", // the values of the attribute come next
  });
}

/** The elements as a schema. xacro tags and macro calls may be anywhere. */
export function schemaOf({ elements, values }: Completions): ElementSpec[] {
  const anywhere = elements.filter(({ name }) => name.startsWith("xacro:")).map(({ name }) => name);
  return elements.map(({ name, attributes, children }) => ({
    name,
    top: name === "robot",
    attributes: attributes.map((attribute) => attributeOf(name, attribute, values)),
    ...(children.length > 0 ? { children: [...children, ...anywhere] } : {}),
  }));
}

function attributeOf(element: string, name: string, values: Completions["values"]): AttrSpec {
  const known = values.find((entry) => entry.element === element && entry.attribute === name)?.values ?? [];
  const insert = snippet(`${name}="\${}"`);
  return {
    name,
    values: known,
    completion: {
      apply: (view, completion, from, to) => {
        if (view.state.sliceDoc(to, to + 1) === "=") {
          view.dispatch({ changes: { from, to, insert: name } });
          return;
        }
        insert(view, completion, from, to);
      },
    },
  };
}

/** The values of an attribute without their quotes, if the cursor is between quotes. CodeMirror would compare the text
 * up to the closing quote with them, and find none for an empty value. */
export function withinQuotes(
  { state }: CompletionContext,
  found: CompletionResult | null,
): CompletionResult | null {
  if (found === null || state.sliceDoc(found.from, found.from + 1) !== '"') return found;
  const options = found.options.map((option) => ({ ...option, label: option.label.slice(1, -1) }));
  return { from: found.from + 1, options, validFor: /^[^"]*$/ };
}

/** Completes the name of a property in `${…}`, or of an argument in `$(arg …)`. */
export function completeName(
  context: CompletionContext,
  { properties, arguments: args }: Completions,
): CompletionResult | null {
  const argument = context.matchBefore(/\$\(arg\s+\w*$/);
  const expression = context.matchBefore(/\$\{[^}"']*$/);
  if (argument === null && expression === null) return null;
  const word = context.matchBefore(/[A-Za-z_]\w*$/);
  if (word === null && !context.explicit && !/[\s{]$/.test((argument ?? expression)!.text)) return null;
  return {
    from: word?.from ?? context.pos,
    options: (argument !== null ? args : properties).map(optionOf),
    validFor: /^\w*$/,
  };
}

function optionOf({ name, value }: NamedValue): Completion {
  return { label: name, type: "variable", ...(value === "" ? {} : { detail: value }) };
}
