"""creepkit: a creep law is written once, as symbols; kernels, simulation, identification and exports follow from it.

Every public name stands once, in __init__.pyi; its module is loaded when the name is first used, so that
`import creepkit` itself is quick.
"""

from creepkit.import_path import leave_working_folder_out_of_command as _leave_working_folder_out

_leave_working_folder_out()  # before anything is imported that could lie there

import lazy_loader as _lazy  # noqa: E402

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)


__version__ = "0.1.0"
