"""Chains: several closed cuts with one pierce, joined by bridges through the scrap."""
