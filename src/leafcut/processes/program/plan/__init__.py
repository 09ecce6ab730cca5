"""Plan how to reorder a program: find the cuts and holes that can move, and the blocks that must stay."""
