"""End mills, their feeds, and their entry moves. All milling processes use these modules."""
