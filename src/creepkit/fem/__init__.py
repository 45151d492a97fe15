"""The axisymmetric finite element solver of creep at finite strain, compiled once for any law."""
