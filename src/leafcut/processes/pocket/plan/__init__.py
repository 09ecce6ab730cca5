"""Plan the milling of pockets: possible tool positions, paths that clear a region, levels, entry moves and wall
passes.
"""
