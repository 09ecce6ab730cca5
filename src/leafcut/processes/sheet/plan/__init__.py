"""Planning of sheets, from the strokes of a drawing to the motions of the torch."""
