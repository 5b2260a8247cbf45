"""stillroom keeps a home's rooms still while the robot's map under them moves."""

import os

# The matrices here are small: threads of one process would only wait for each other. Processes, one a core, share the work.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = "0.1.0"
