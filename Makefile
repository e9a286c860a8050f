# make run    the bench, played: Soyuz, four antennas, two processes on a bus of their own
# make test   style, architecture, tests
# make bench  speeds
# make mutants   do the tests catch small faults in the code? of="PACKAGE or ID ..." for some of them
# make results  every published figure, measured: docs/results.md; QUICK=1 for those of minutes
# make docs   the documents that are generated from code and tests
# Each makes its own virtual environment; nothing but Python 3.11 or newer is needed.

PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed

.PHONY: venv run test bench mutants docs results clean

run: $(STAMP)
	$(BIN)/gnss-hil run soyuz

test: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/python -m pytest -q

bench: $(STAMP)
	@for file in tests/benchmarks/[a-z]*.py; do \
	  echo "== $$file"; $(BIN)/python -m tests.benchmarks.$$(basename $$file .py) || exit 1; done

mutants: $(STAMP)
	$(BIN)/python -m tests.mutants --jobs 2 $(of)

docs: $(STAMP)
	$(BIN)/python -m tests.documents

results: $(STAMP)
	$(BIN)/python -m tests.results $(if $(QUICK),--quick); status=$$?; $(BIN)/python -m tests.documents; exit $$status

venv: $(STAMP)

$(STAMP): pyproject.toml
	@echo 'installing into $(VENV) (a minute or so) ...'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	touch $@

clean:
	rm -rf $(VENV) runs
