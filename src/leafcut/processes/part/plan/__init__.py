"""Planning of a part: tool paths beside the outlines, tabs, and start points."""
