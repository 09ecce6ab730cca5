"""Planning of sheets: from a drawing's strokes to the motions of the torch."""
