"""Studies: a file that declares the way from measured data to a report, its stages, and what they leave in a folder."""
