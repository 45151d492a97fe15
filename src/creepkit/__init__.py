"""creepkit: a creep law is written once, as symbols; kernels, simulation, identification and exports follow from it.

Every public name stands once, in __init__.pyi; its module is loaded when the name is first used, so that
`import creepkit` itself is quick.
"""

from creepkit import import_path as _import_path

if _import_path.is_the_command_line():
    _import_path.leave_working_folder_out()  # before anything is imported that could lie there
    _import_path.end_without_traceback_at_ctrl_c()

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)


__version__ = "0.1.0"
