"""Machine time: of a move, of travel between nodes, of a whole toolpath."""
