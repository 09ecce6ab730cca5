// Lint rules for the scripts of the studio. tsc (tsconfig.json) finds undefined and unused names.
import js from "@eslint/js";
import globals from "globals";

export default [
  { ignores: [".venv*/", "build/", "dist/", "site/", "htmlcov/"] },
  js.configs.recommended,
  {
    languageOptions: { globals: globals.browser },
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      "no-unused-vars": "off", // tsc, which knows the types that comments use
      "no-undef": "off", // tsc
      "no-self-compare": "off", // x === x is false for NaN, and fast
      eqeqeq: "error",
      "no-var": "error",
      "prefer-const": ["error", { destructuring: "all" }],
      "object-shorthand": "error",
      "max-len": ["error", { code: 160, ignoreStrings: true, ignoreTemplateLiterals: true }],
    },
  },
];
