"""One thread per test process, since numerical libraries would otherwise start a pool each, whose threads wait for each
other where there are more of them than cores; and Ctrl-C works in tests even where they are started in the background,
where shells have it ignored."""

import os
import signal

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
