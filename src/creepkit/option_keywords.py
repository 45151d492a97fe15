"""Keywords of options, for type checkers and editors: they stand in the stub beside this file, and not at run time."""
