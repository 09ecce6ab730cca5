"""Which ants find the shortest tour of a board? Each algorithm, five seeds, the same number of iterations."""

from __future__ import annotations

from statistics import median

import leafcut


def main() -> None:
    """Print the median and the best length of every algorithm."""
    board = leafcut.read_part("example:board-97")
    for algorithm in ("nn", "2opt", "as", "eas", "asrank", "mmas", "acs"):
        lengths = [
            leafcut.solve(board, algorithm=algorithm, seed=seed, iterations=20).solution.cost for seed in range(5)
        ]
        print(f"{algorithm:7} median {median(lengths):8.1f} mm   best {min(lengths):8.1f} mm")


if __name__ == "__main__":
    main()
