"""Axisymmetric finite elements of creep at finite strain, and reduced-order models of them; the core solves both."""
