"""The implicit adaptive integration of creep at a material point, and of fibres, in the compiled core.

Every name stands once, in __init__.pyi; its module is loaded when the name is first used.
"""

import lazy_loader as _lazy

__getattr__, __dir__, __all__ = _lazy.attach_stub(__name__, __file__)
