"""The reduced-order model of the bulge test: one degree of freedom with tables of the very dimple."""
