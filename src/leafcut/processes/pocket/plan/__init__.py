"""Planning of pockets: possible positions of the tool, paths that clear a region, levels, entries and walls."""
