"""Facts, texts and drawings of pockets for reports."""
