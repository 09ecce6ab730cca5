"""The common parts of every proof: what was written is what was planned, and is safe."""
