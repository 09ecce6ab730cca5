"""Common cuts: parts a kerf apart share the cut between their straight edges."""
