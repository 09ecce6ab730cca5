"""Tool, feeds and entries of end mills, shared by all milling processes."""
