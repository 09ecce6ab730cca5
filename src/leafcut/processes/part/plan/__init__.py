"""Plan the milling of a part: tool paths along the edges, tabs, and start points."""
