"""Planning of a reordered program: finds the cuts and holes that can move, and the blocks that must stay."""
