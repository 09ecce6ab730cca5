"""Algorithms of the literature: each constructs tours and reinforces trails or positions, as its paper describes.

`places` and `choices` are the two move sets; the algorithms are written once for both.
"""
