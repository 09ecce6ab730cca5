"""Reports of a cut sheet: facts, tables and drawings."""
