"""Imported by the fork server: it loads the library and its compiled kernels once, and every solver is forked from it.

So a solver is ready some milliseconds after the one before it died. The fork server has one thread and stays so.
"""

import gc
import signal

from ..memory import give_back
from .warm import warm

if __name__ != "__main__":
    # a supervisor signals the whole group: solvers finish what they have, and end when the service does
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    give_back()
    warm()
    gc.freeze()  # what is loaded stays: looking through it again would copy its pages into every solver
