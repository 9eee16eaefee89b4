"""Types of arrays in signatures. Docstrings give shapes and units."""

import numpy as np
from numpy.typing import NDArray

Array = np.ndarray  # of doubles, unless a docstring says otherwise
Indices = NDArray[np.int64]
