"""Common parts of every proof: the written program is what was planned, and is safe."""
