# make demo, make test, ... each work as the only command on a fresh clone.

VENV := .venv
BIN := $(VENV)/bin
PYTHON ?= python3 python3.13 python3.12 python3.11
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check

.PHONY: demo test lint gallery bench clean

demo: $(VENV)/.installed
	$(BIN)/intaglio demo -o plates

test: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n auto --maxprocesses 4 --dist worksteal

lint: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

gallery: $(VENV)/.installed
	$(BIN)/python examples/gallery.py

bench: $(VENV)/.installed-bench
	$(BIN)/python -m pytest benchmarks --benchmark-enable --benchmark-only --benchmark-autosave --benchmark-storage=.benchmarks

clean:
	rm -rf plates dist .benchmarks .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find . -path ./$(VENV) -prune -o -name __pycache__ -prune -exec rm -rf {} +

# The first Python in the list that is new enough; a half-made environment does not stay behind.
$(VENV)/pyvenv.cfg:
	@for python in $(PYTHON); do \
	  if $$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then \
	    echo "Making $(VENV) with $$($$python --version)"; \
	    $$python -m venv $(VENV) && exit 0; \
	    rm -rf $(VENV); exit 1; \
	  fi; \
	done; \
	echo "Intaglio needs Python 3.11 or newer; looked for: $(PYTHON). Name yours: make PYTHON=/path/to/python3" >&2; \
	exit 1

$(VENV)/.installed: $(VENV)/pyvenv.cfg pyproject.toml
	@echo "Installing intaglio and what it needs (once)"
	@$(PIP) --editable .
	@touch $@

$(VENV)/.installed-%: $(VENV)/pyvenv.cfg pyproject.toml
	@echo "Installing intaglio[$*] and what it needs (once)"
	@$(PIP) --editable ".[$*]"
	@touch $@
