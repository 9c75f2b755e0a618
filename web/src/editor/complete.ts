import {
  autocompletion,
  snippet,
  startCompletion,
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
  let fromSchema: CompletionSource = () => null;
  const complete: CompletionSource = (context) => {
    const now = current();
    if (now === null) return null;
    if (now !== known) {
      known = now;
      fromSchema = completeFromSchema(schemaOf(now), []);
    }
    return completeName(context, now) ?? fromSchema(context);
  };
  return autocompletion({ override: [complete], icons: false });
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
        if (known.length > 0) setTimeout(() => startCompletion(view)); // after the list of names has closed
      },
    },
  };
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
