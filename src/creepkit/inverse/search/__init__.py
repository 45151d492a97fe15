"""Where identifications begin: global searches over a landscape, each polished by least squares."""
