"""Create reports: a summary for the terminal, a page for screen and paper, JSON answers, and pictures."""
