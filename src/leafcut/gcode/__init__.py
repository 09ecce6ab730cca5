"""G-code: words, modal groups, number formats, dialects, and the interpreter that converts a text to a `Toolpath`."""
