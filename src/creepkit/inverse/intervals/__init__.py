"""How sure: profiles, samples, mixtures over laws, bands, and what is not determined."""
