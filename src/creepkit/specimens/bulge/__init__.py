"""The bulge test: geometry, observation, finite elements and reduced-order model of a dimple under gas pressure."""
