"""Random numbers of the kernels, written from the published description."""

from __future__ import annotations


class Xorshift:
    """The generator of G. Marsaglia, J. Statistical Software 8 (2003), triple (13, 7, 17), with a state of 64 bits."""

    def __init__(self, state: int) -> None:
        self.state = state

    def word(self) -> int:
        """Return the next state."""
        for shift in (13, -7, 17):
            self.state ^= (self.state << shift if shift > 0 else self.state >> -shift) & (2**64 - 1)
        return self.state

    def uniform(self) -> float:
        """Return a number in [0, 1) of 53 bits."""
        return (self.word() >> 11) / 2**53

    def below(self, n: int) -> int:
        """Return one of 0 … n - 1."""
        return int(self.uniform() * n)
