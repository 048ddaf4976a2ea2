# Every target does its own set-up in .venv; all it needs is Python >= 3.11, make and a package index.
#   make demo        prove and plan the two-link arm (core dependencies only)
#   make test        lint, types, tests            make soundness   the long campaign
#   make bench       speed and width beside the published figures
#   make mutants     plant faults in the proof engine and see that the tests catch each
PYTHON ?= $(shell command -v python3.11 || command -v python3 || command -v python)
BIN := .venv/bin
PYTEST := $(BIN)/python -m pytest
export MPLBACKEND := Agg

.PHONY: demo test lint bench soundness mutants clean
.DEFAULT_GOAL := test

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "modegraph needs Python 3.11 or newer; name one with: make PYTHON=/path/to/python"; exit 1; }
	$(PYTHON) -m venv .venv

.venv/.core: pyproject.toml | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

.venv/.develop: pyproject.toml | .venv/bin/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test,lint]'
	@touch $@ .venv/.core

demo: .venv/.core
	$(BIN)/modegraph demo arm

lint: .venv/.develop
	$(BIN)/python -m ruff check .
	$(BIN)/python -m ruff format --check .
	$(BIN)/python -m mypy

test: lint
	$(PYTEST) -n 2 --dist worksteal -m "not campaign"

soundness: .venv/.develop
	$(PYTEST) -n 2 --dist worksteal -m campaign -o faulthandler_timeout=0 tests/soundness

mutants: .venv/.develop
	$(BIN)/python -m tests.mutants

bench: .venv/.core
	$(BIN)/python -m benchmarks

clean:
	rm -rf .venv build dist .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
