"""G-code: words, modal groups, number formats, dialects, and the interpreter that turns text into a `Toolpath`."""
