"""Every published figure: the command that gives it, how it is read, and the page of all, docs/results.md.

    make results             everything; hours
    make results QUICK=1     what takes minutes
    python -m tests.results NAME ...

Figures are kept in docs/results.json, each with its command, date, commit and machine. What the present
commit has measured already is not measured again (`--again` does), so an interrupted round goes on where it
stopped; what is not measured anew keeps its older date on the page.
"""
