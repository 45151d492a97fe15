"""Data sets: the simulated tests of a sampling design, made in shards and kept in HDF5 files."""
