"""The public functions: each resolves names of laws and specimens and passes the work on; `creepkit` lists them all."""
