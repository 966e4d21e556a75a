"""What all tests share. It runs before numpy is imported, which reads the thread counts then."""

import os
import signal

from hypothesis import settings

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

# Who runs tests in the background may ignore Ctrl-C; the processes that they start shall not inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples in every run, however busy the machine is.
settings.register_profile("relform", deadline=None, derandomize=True)
settings.load_profile("relform")
