PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.DEFAULT_GOAL := help
.PHONY: help setup run test lint bench docs clean

help: ## say what there is to make
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | awk -F':.*## ' '{printf "make %-7s %s\n", $$1, $$2}'

setup: $(READY) ## make .venv with everything in it

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "a7sim: expected Python 3.11 or newer, got " + sys.version.split()[0] + " (make PYTHON=python3.x ...)")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

run: $(READY) ## let the operator work through the Akwanga scenario; files in runs/akwanga
	$(BIN)/a7sim run scenarios/akwanga.toml --out runs/akwanga --force

test: $(READY) ## run all tests
	$(BIN)/python -m pytest --numprocesses 2 --dist loadgroup

lint: $(READY) ## check style, types and the direction of imports
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

bench: $(READY) ## run every benchmark, about ten minutes, into docs/benchmarks.md (BENCH=--full: an hour and more)
	$(BIN)/python benchmarks/bench.py $(BENCH)

docs: $(VENV)/.docs-ready ## build the documentation into site/; nothing in it asks the network
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet

$(VENV)/.docs-ready: $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[docs]'
	@touch $@

clean: ## remove what make made
	rm -rf $(VENV) runs site .pytest_cache .mypy_cache .ruff_cache .hypothesis
