"""Precedence between pieces of work, and the reasons why pieces stay."""
