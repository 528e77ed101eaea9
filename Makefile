# make map   sets up an environment and computes the map of response types (map.nc, map.png)
# make test  sets up everything the tests need and runs them

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet

# Of the map; override on the command line, e.g. make map MODES=1 CYCLES=1000
MODES ?= 32
CYCLES ?= 200
FREQUENCY_RATIO ?= 0.1:4:64
VELOCITY_AMPLITUDE ?= 0.01:0.65:40
LOCATION ?= 0.47619
MAP ?= map.nc
PLOT ?= map.png

# Processes that the tests are shared out to
WORKERS ?= 2

# Where the benchmarks write; the docs show what is in docs/images
BENCH ?= out/bench

.PHONY: help map tables prose explorer-deps test quick-tests test-slow test-oldest lint docs bench audit dist clean

help:
	@echo "make map        compute the response map ($(MAP), $(PLOT)); variables: MODES CYCLES FREQUENCY_RATIO"
	@echo "                VELOCITY_AMPLITUDE LOCATION MAP PLOT"
	@echo "make test       lint, types, import contracts and the tests"
	@echo "make test-slow  the tests that take longer"
	@echo "make explorer-deps   what the explorer and its tests in a browser need"
	@echo "make test-oldest  the tests with the oldest packages that are allowed, on Python 3.11"
	@echo "make docs       the documentation, in docs/_build/html"
	@echo "make tables     the tables of the reference pages, from the program"
	@echo "make prose      a report on the sentences of the pages"
	@echo "make bench      the benchmarks, in out/bench; variable: BENCH"
	@echo "make audit      known vulnerabilities of the pinned packages"
	@echo "make dist       wheel and source archive, each installed alone and run"
	@echo "make clean      remove what was built (not the environment, not results)"

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

# One stamp per set of packages: a second make installs nothing again.
$(VENV)/.installed-run: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) install --constraint constraints.txt --editable .
	@touch $@

$(VENV)/.installed-test: pyproject.toml constraints.txt $(VENV)/.installed-run
	$(PIP) install --constraint constraints.txt --editable ".[dev,lab,cluster,video]"
	@touch $@

$(VENV)/.installed-docs: pyproject.toml constraints.txt $(VENV)/.installed-run
	$(PIP) install --constraint constraints.txt --editable ".[docs,lab,cluster,video]"
	@touch $@

$(VENV)/.installed-bench: pyproject.toml constraints.txt $(VENV)/.installed-test
	$(PIP) install --constraint constraints.txt --editable ".[bench]"
	$(PIP) install --constraint constraints.txt --editable ".[bench-fortran]" \
		|| echo "numbalsoda left out: building it needs a Fortran compiler"
	@touch $@

map: $(VENV)/.installed-run
	$(BIN)/snapbeam map --modes $(MODES) --cycles $(CYCLES) --frequency-ratio $(FREQUENCY_RATIO) \
		--velocity-amplitude $(VELOCITY_AMPLITUDE) --location $(LOCATION) -o $(MAP) --plot $(PLOT)

# The browser is the system's: its tests are skipped, with a line, where there is none.
explorer-deps: $(VENV)/.installed-test
	$(PIP) install --constraint constraints.txt --editable ".[explorer,explorer-test]"
	@command -v chromium >/dev/null || command -v chromium-browser >/dev/null \
		|| echo "no Chromium: install it with the system's packages (Debian: apt-get install chromium), or set CHROMIUM"

lint: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The linters take one minute beside the tests.
test:
	$(MAKE) --no-print-directory --jobs 2 lint quick-tests

quick-tests: $(VENV)/.installed-test
	$(BIN)/python -m pytest -m "not slow" --durations=15 -n $(WORKERS) --dist loadfile --no-loadscope-reorder

test-slow: $(VENV)/.installed-test
	$(BIN)/python -m pytest -m slow --durations=15 -n $(WORKERS) --dist loadfile

# The lower bounds that pyproject.toml states, installed and tested.  Python 3.11 is the oldest.
OLDEST ?= .venv-oldest
OLDEST_PYTHON ?= python3.11

$(OLDEST)/.installed: pyproject.toml tests/reliability/oldest.py
	$(OLDEST_PYTHON) -m venv $(OLDEST)
	$(OLDEST)/bin/python tests/reliability/oldest.py lab cluster video dev > $(OLDEST)/oldest.txt
	$(OLDEST)/bin/python -m pip install --quiet --requirement $(OLDEST)/oldest.txt
	$(OLDEST)/bin/python -m pip install --quiet --no-deps --editable .
	@touch $@

test-oldest: $(OLDEST)/.installed
	$(OLDEST)/bin/python -m pytest -m "not slow" --durations=15

docs: $(VENV)/.installed-docs
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html

tables: $(VENV)/.installed-test
	$(BIN)/python docs/_ext/reference.py

prose: $(VENV)/.installed-run
	$(BIN)/python tests/docs/prose.py

bench: $(VENV)/.installed-bench
	$(BIN)/python -m benchmarks -o $(BENCH)

audit: $(VENV)/.installed-test
	$(PIP) install --constraint constraints.txt pip-audit
	$(BIN)/python -m pip_audit --requirement constraints.txt --no-deps --disable-pip

dist: $(VENV)/.installed-test
	$(PIP) install --constraint constraints.txt build
	rm -rf dist
	$(BIN)/python -m build --outdir dist .
	$(BIN)/python tests/release/alone.py dist

clean:
	rm -rf build dist docs/_build docs/gallery docs/_paper docs/_generated docs/sg_execution_times.rst .pytest_cache .mypy_cache \
		.ruff_cache .import_linter_cache .hypothesis
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +
