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

.PHONY: help map core tables prose explorer-deps test quick-tests test-slow test-oldest coverage lint lock docs bench audit release dist clean

help:
	@echo "make map        compute the response map ($(MAP), $(PLOT)); variables: MODES CYCLES FREQUENCY_RATIO"
	@echo "                VELOCITY_AMPLITUDE LOCATION MAP PLOT"
	@echo "make core       the native core again after a change of its sources; the other targets do it themselves"
	@echo "make test       lint, types, import contracts, metadata and the tests"
	@echo "make test-slow  the tests that take longer"
	@echo "make explorer-deps   what the explorer and its tests in a browser need"
	@echo "make test-oldest  the tests with the oldest packages that are allowed, on Python 3.11"
	@echo "make docs       the documentation, in docs/_build/html"
	@echo "make tables     the tables of the reference pages, from the program"
	@echo "make prose      a report on the sentences of pages, docstrings, help and labels"
	@echo "make bench      the benchmarks, in out/bench; variable: BENCH"
	@echo "make coverage   the lines that the quick tests run"
	@echo "make lock       requirements-dev.txt from constraints.txt, with hashes"
	@echo "make audit      known vulnerabilities of the pinned packages"
	@echo "make release    version and repository in every file; variables: VERSION, REPOSITORY"
	@echo "make dist       wheel and source archive, each installed alone and run"
	@echo "make clean      remove what was built (not the environment, not results)"

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

# What the native core is made from: after a change the editable install builds it again, in seconds, and only what changed.
CORE := CMakeLists.txt $(wildcard build_backend/*.py src/snapbeam/core/*)

# One stamp per set of packages: a second make installs nothing again.  Of the tests every package is compared with its hash, in a
# list that is complete.  Python compiles the modules that it imports, which are the fewest: all of them take half a minute.
LOCKED := $(PIP) install --require-hashes --no-deps --no-compile --requirement

# What builds the core comes first, a compiler too where there is none: with two jobs the core is built while a new pip, in two thirds of
# the time of an old one, installs the other packages.
$(VENV)/.locked-build: requirements-dev.txt | $(BIN)/python
	awk '/^[^ ]/ { of_build = /^(cmake|nanobind|ninja|packaging|pathspec|pip|scikit-build-core)==/ } of_build' $< > $(VENV)/build.txt
	$(LOCKED) $(VENV)/build.txt
	PATH="$(abspath $(BIN)):$$PATH" PYTHONPATH=build_backend $(BIN)/python -c \
		"import snapbeam_build; print('# beside', *snapbeam_build.get_requires_for_build_editable(), sep='\n')" > $(VENV)/build.txt
	$(PIP) install --constraint constraints.txt --requirement $(VENV)/build.txt
	@touch $@

$(VENV)/.locked-dev: requirements-dev.txt $(VENV)/.locked-build
	$(LOCKED) $<
	@touch $@

$(VENV)/.pinned-run: pyproject.toml constraints.txt $(VENV)/.locked-build
	$(BIN)/python -c "import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['project']['dependencies'], sep='\n')" > $(VENV)/run.txt
	$(PIP) install --constraint constraints.txt --requirement $(VENV)/run.txt
	@touch $@

$(VENV)/.built: pyproject.toml $(CORE) $(VENV)/.locked-build
	PATH="$(abspath $(BIN)):$$PATH" $(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.installed-run: $(VENV)/.built $(VENV)/.pinned-run
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.built $(VENV)/.locked-dev
	@touch $@

core: $(VENV)/.installed-dev

$(VENV)/.installed-bench: pyproject.toml constraints.txt $(VENV)/.installed-dev
	$(PIP) install --constraint constraints.txt --group bench
	$(PIP) install --constraint constraints.txt --group bench-fortran \
		|| echo "numbalsoda left out: building it needs a Fortran compiler"
	@touch $@

map:
	$(MAKE) --no-print-directory --jobs 2 $(VENV)/.installed-run
	$(BIN)/snapbeam map --modes $(MODES) --cycles $(CYCLES) --frequency-ratio $(FREQUENCY_RATIO) \
		--velocity-amplitude $(VELOCITY_AMPLITUDE) --location $(LOCATION) -o $(MAP) --plot $(PLOT)

# The browser is the system's: its tests are skipped, with a line, where there is none.
explorer-deps: $(VENV)/.installed-dev
	$(PIP) install --constraint constraints.txt --group browser --editable ".[explorer]"
	@command -v chromium >/dev/null || command -v chromium-browser >/dev/null \
		|| echo "no Chromium: install it with the system's packages (Debian: apt-get install chromium), or set CHROMIUM"

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/validate-pyproject pyproject.toml
	$(BIN)/sp-repo-review .
	$(BIN)/zizmor --offline --quiet --persona auditor .github

# The linters take three quarters of a minute beside the tests.
test:
	$(MAKE) --no-print-directory --jobs 2 lint quick-tests

# In the order of tests/conftest.py, which ends with the shortest; else files of few tests, often the longest, come last.
quick-tests: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -m "not slow" --durations=15 -n $(WORKERS) --dist loadfile --no-loadscope-reorder

# Lines of the core and its parts that the quick tests run; the native core is not counted.
coverage: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -m "not slow" -n $(WORKERS) --dist loadfile --cov=snapbeam --cov-report=term --cov-report=xml

test-slow: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -m slow --durations=15 -n $(WORKERS) --dist worksteal

# The lower bounds that pyproject.toml states, installed and tested.  Python 3.11 is the oldest.
OLDEST ?= .venv-oldest
OLDEST_PYTHON ?= python3.11

$(OLDEST)/.installed: pyproject.toml $(CORE) tests/reliability/oldest.py
	$(OLDEST_PYTHON) -m venv $(OLDEST)
	$(OLDEST)/bin/python tests/reliability/oldest.py lab cluster video laws test > $(OLDEST)/oldest.txt
	$(OLDEST)/bin/python -m pip install --quiet --requirement $(OLDEST)/oldest.txt
	$(OLDEST)/bin/python -m pip install --quiet --no-deps --editable .
	@touch $@

test-oldest: $(OLDEST)/.installed
	$(OLDEST)/bin/python -m pytest -m "not slow" --durations=15

docs: $(VENV)/.installed-dev
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html

tables: $(VENV)/.installed-dev
	$(BIN)/python docs/_ext/reference.py

prose: $(VENV)/.installed-run
	$(BIN)/python tests/prose.py

bench: $(VENV)/.installed-bench
	$(BIN)/python -m benchmarks -o $(BENCH)

# The exact versions of constraints.txt with the hashes of their files, for every platform.
lock: constraints.txt
	$(PIP) install uv
	$(BIN)/uv pip compile --quiet --universal --generate-hashes --no-header --no-annotate --constraint constraints.txt \
		--python-version 3.11.5 --extra lab --extra cluster --extra video --extra laws --group dev pyproject.toml \
		--output-file requirements-dev.txt

audit: $(VENV)/.installed-dev
	$(PIP) install --constraint constraints.txt --group archives
	$(BIN)/python -m pip_audit --strict --requirement constraints.txt --no-deps --disable-pip

release: $(VENV)/.installed-dev
	$(BIN)/python tests/release/prepare.py "$(VERSION)" "$(REPOSITORY)"

dist: $(VENV)/.installed-dev
	$(PIP) install --constraint constraints.txt --group archives
	rm -rf dist
	$(BIN)/python -m build --outdir dist -C cmake.define.SNAPBEAM_SETS=all .
	$(BIN)/python -m twine check --strict dist/*
	$(BIN)/python tests/release/alone.py dist

clean:
	rm -rf build dist docs/_build docs/gallery docs/_paper docs/_generated docs/sg_execution_times.rst .pytest_cache .mypy_cache \
		.ruff_cache .import_linter_cache .hypothesis
	rm -f src/snapbeam/_core*.so src/snapbeam/_core*.pyd $(VENV)/.installed-run $(VENV)/.built
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +
