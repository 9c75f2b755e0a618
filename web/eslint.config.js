import eslint from "@eslint/js";
import { defineConfig, globalIgnores } from "eslint/config";
import tseslint from "typescript-eslint";

export default defineConfig(
  // `python -m kbot.workbench.typescript` writes the last three; tests/workbench/test_protocol.py compares them
  globalIgnores(["dist", "src/protocol.ts", "src/messages.ts", "src/displays/kinds.ts"]),
  eslint.configs.recommended,
  tseslint.configs.strictTypeChecked,
  tseslint.configs.stylisticTypeChecked,
  {
    languageOptions: { parserOptions: { projectService: true } },
    rules: {
      // tsconfig.json sets noUncheckedIndexedAccess, so an index that a loop keeps in range needs a `!`
      "@typescript-eslint/no-non-null-assertion": "off",
      // callbacks such as `() => this.close()` are shorter without braces and equally clear
      "@typescript-eslint/no-confusing-void-expression": [
        "error",
        { ignoreArrowShorthand: true, ignoreVoidReturningFunctions: true },
      ],
      // an empty text means "not set" in the protocol and in settings
      "@typescript-eslint/prefer-nullish-coalescing": [
        "error",
        { ignorePrimitives: { string: true, boolean: true, number: true } },
      ],
      // numbers have one obvious text form
      "@typescript-eslint/restrict-template-expressions": [
        "error",
        {
          allowAny: false,
          allowBoolean: false,
          allowNever: false,
          allowNullish: false,
          allowNumber: true,
          allowRegExp: false,
        },
      ],
    },
  },
  { files: ["**/*.js"], extends: [tseslint.configs.disableTypeChecked] },
);
