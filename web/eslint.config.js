import js from "@eslint/js";
import globals from "globals";

const MAX_STATEMENTS = { file: 400, function: 45 }; // as tests/test_house.py has them for Python
const MAX_BRANCHES = 24;

/** A file has few enough statements. */
const fileStatements = {
  meta: { type: "suggestion", messages: { many: "{{count}} statements in this file; at most {{limit}}." }, schema: [] },
  create(context) {
    let count = 0;
    return {
      ":statement"(node) {
        if (node.type !== "BlockStatement") count += 1;
      },
      "Program:exit"(node) {
        const limit = MAX_STATEMENTS.file;
        if (count > limit) context.report({ node, messageId: "many", data: { count: String(count), limit: String(limit) } });
      },
    };
  },
};

export default [
  js.configs.recommended,
  { files: ["src/**/*.js"], languageOptions: { globals: globals.browser } },
  { files: ["*.js", "*.mjs"], languageOptions: { globals: globals.node } },
  {
    plugins: { house: { rules: { "file-statements": fileStatements } } },
    rules: {
      complexity: ["error", MAX_BRANCHES],
      "house/file-statements": "error",
      "max-statements": ["error", MAX_STATEMENTS.function],
      curly: ["error", "multi-line"],
      eqeqeq: "error",
      "no-eval": "error",
      "no-implied-eval": "error",
      "no-new-func": "error",
      "no-unused-vars": ["error", { argsIgnorePattern: "^_" }],
      "no-var": "error",
      "prefer-const": ["error", { destructuring: "all" }],
      // The Content-Security-Policy refuses styles in markup, and texts of others never are markup.
      "no-restricted-properties": ["error", ...["innerHTML", "outerHTML", "insertAdjacentHTML"].map((property) => (
        { property, message: "Make elements with lib/dom.js." }
      ))],
    },
  },
];
