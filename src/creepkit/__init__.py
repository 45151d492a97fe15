"""creepkit: a creep law is written once, as symbols; kernels, simulation, identification and exports follow from it.

Every public name stands once, in __init__.pyi; its module is loaded when the name is first used, so that
`import creepkit` itself is quick.
"""

import sys as _sys

if _sys.orig_argv[1:3] == ["-m", "creepkit"] and _sys.argv[:1] == ["-m"] and not _sys.flags.safe_path:
    del _sys.path[:1]  # the working folder, where a file beside the data, such as json.py, would be executed

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)


__version__ = "0.1.0"
