"""What all tests share."""

from creepkit.cli.compiled import share_compiled_code

share_compiled_code()
