"""The machine's time: of one move, of travel between nodes, of a whole toolpath."""
