"""gnss-hil: a hardware-in-the-loop bench for spacecraft satellite navigation on CAN.

    gnss_hil.run        play a scenario from a program; returns a Run, its record
    gnss_hil.Run        fixes, truth, checks, errors of a finished run, as Polars tables
    gnss_hil.Bench      what the pytest fixture `bench` is
    gnss_hil.BenchError what can go wrong, in one line

    gnss_hil.dbc        the bus contract, and ways onto a bus
    gnss_hil.emulator   truth: sky, craft, receivers
    gnss_hil.flightsw   flight software
    gnss_hil.tools      the person at the bench

The last four are the folders of the same names in a checkout. This file is the package's `__init__.py`. Its
names are imported when they are used first; `__init__.pyi` has their types.
"""

_HOME = {
    "Bench": "gnss_hil.tools.bench.fixture",
    "BenchError": "gnss_hil.tools.bench.errors",
    "Run": "gnss_hil.tools.bench.record",
    "run": "gnss_hil.tools.bench.run",
}
"""Name -> module that has it."""

__all__ = [*_HOME]


def __getattr__(name: str):
    if name not in _HOME:
        raise AttributeError(f"module 'gnss_hil' has no attribute '{name}'")
    from importlib import import_module

    try:
        found = getattr(import_module(_HOME[name]), name)
    except ModuleNotFoundError as error:
        if error.name != "polars":
            raise
        raise ImportError(f"gnss_hil.{name} needs Polars: pip install 'gnss-hil[bench]'") from None
    globals()[name] = found  # the next look-up costs nothing
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
