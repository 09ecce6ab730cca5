"""Planning of programs: the work that can be reordered, and the blocks that must stay."""
