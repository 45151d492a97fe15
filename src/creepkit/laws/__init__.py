"""The built-in laws, one a file; each imports the language only, as an outside plugin does."""
