"""Planning of pockets: where the tool may be, the paths that clear a region, levels, entries and walls."""
