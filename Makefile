# make run    the bench, played: Soyuz, four antennas, two processes on a bus of their own
# make test   style, architecture, types, tests; on all processors
# make quick  the tests of single modules: the inner loop
# make bench  speeds
# make strays  the record against one stray frame at every bad moment, and processes that stand still (half an hour)
# make mutants   do the tests catch small faults in the code? of="PACKAGE or ID ..." for some of them
# make results  every published figure, measured: docs/results.md; QUICK=1 for those of minutes
# make docs   the documents that are generated from code and tests
# make clean  removes the virtual environment, what was built, and runs/
# Each makes its own virtual environment, `run` with what the bench needs, the others with the developers' tools
# too; nothing but Python 3.11 or newer is needed.

PYTHON ?= python3
# Of the tests: one more than there are processors, since some tests wait.
WORKERS ?= $(shell expr $$(nproc) + 1)
VENV   ?= .venv
BIN    := $(VENV)/bin
RUNTIME     := $(VENV)/.runtime
DEVELOPMENT := $(VENV)/.development
INSTALL     := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
PYTEST      := $(BIN)/python -m pytest -q -n $(WORKERS) --dist loadgroup --no-loadscope-reorder

# Programs are compiled once and not at each of a thousand starts, whatever the environment asks for.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: venv run test quick bench strays mutants docs results clean

run: $(RUNTIME)
	$(BIN)/gnss-hil run soyuz

test: $(DEVELOPMENT)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	@said=$$(mktemp); $(BIN)/basedpyright --level error >$$said 2>&1 & checker=$$!; trap 'kill $$checker' INT TERM; \
	$(PYTEST); tests=$$?; wait $$checker; types=$$?; cat $$said; rm $$said; exit $$((tests || types))

quick: $(DEVELOPMENT)
	$(PYTEST) -m 'not slow and not realdata' tests/dbc tests/emulator tests/flightsw tests/tools

bench: $(DEVELOPMENT)
	@for file in tests/benchmarks/[a-z]*.py; do \
	  echo "== $$file"; $(BIN)/python -m tests.benchmarks.$$(basename $$file .py) || exit 1; done

strays: $(DEVELOPMENT)
	$(MAKE) -C examples/fsw_c PYTHON=$(abspath $(BIN))/python GNSS_HIL=$(abspath $(BIN))/gnss-hil
	$(BIN)/python -m tests.support.strays --flight examples/fsw_c/build/fsw
	$(BIN)/python -m tests.support.stalls --flight examples/fsw_c/build/fsw
	$(BIN)/python -m tests.support.stalls --seconds 0 7 --paces lockstep

mutants: $(DEVELOPMENT)
	$(BIN)/python -m tests.mutants --jobs 2 $(of)

docs: $(DEVELOPMENT)
	$(BIN)/python -m tests.documents

results: $(DEVELOPMENT)
	$(BIN)/python -m tests.results $(if $(QUICK),--quick); status=$$?; $(BIN)/python -m tests.results.fault_library || status=1; $(BIN)/python -m tests.documents; exit $$status

venv: $(DEVELOPMENT)

$(RUNTIME): pyproject.toml
	@echo 'installing into $(VENV) (half a minute or so) ...'
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) -e .
	touch $@

$(DEVELOPMENT): $(RUNTIME)
	@echo "installing the developers' tools into $(VENV) (a minute or so) ..."
	$(INSTALL) -e '.[dev]'
	touch $@

clean:
	rm -rf $(VENV) build dist examples/fsw_c/build runs
