"""G-code: words, modal groups, number formats, dialects, and the interpreter that converts text to a `Toolpath`."""
