"""Reports: a summary for the terminal and a page for the screen and for paper."""
