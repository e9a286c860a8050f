"""Settings for every test."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

from hypothesis import settings

# Machines are noisy: no test fails on a time. Derandomised, so that a red run is red again.
settings.register_profile("bench", deadline=None, derandomize=True)
settings.load_profile("bench")
