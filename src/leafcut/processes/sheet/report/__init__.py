"""Reports about a cut sheet: facts, tables and drawings."""
