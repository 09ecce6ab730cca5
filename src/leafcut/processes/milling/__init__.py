"""The tool, feeds and entries of end mills, which all milling processes share."""
