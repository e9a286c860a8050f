"""What is validated by whom, and what is only modelled: collected from the tests that judge it.

A test, or a whole file of tests by its `pytestmark`, says what it judges:

    @pytest.mark.verifies(
        "emulator/signal/geometry.py",
        what="Light time, Sagnac, Shapiro, range rate",
        by="80-bit brute force (1 um); quadrature of the potential",
        status="validated",
    )

`what` is the row's name. Further tests of the same row have `@pytest.mark.verifies(what="...")` alone. Rows
whose judge is no test stand in extra.toml. `make docs` writes VERIFICATION.md and a page for each package.
"""
