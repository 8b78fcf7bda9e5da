PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
READY := $(VENV)/.ready
CHECK_PYTHON := import sys; sys.exit(sys.version_info < (3, 11) and "a7sim: expected Python 3.11 or newer, got " + sys.version.split()[0] + " (make PYTHON=python3.x ...)")
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.DEFAULT_GOAL := help
.PHONY: help setup run test lint generated bench docs clean

help: ## list the targets
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | awk -F':.*## ' '{printf "make %-7s %s\n", $$1, $$2}'

setup: $(READY) ## make .venv with everything in it

$(INSTALLED): pyproject.toml constraints.txt
	@$(PYTHON) -c '$(CHECK_PYTHON)'
	$(PYTHON) -m venv $(VENV)
	$(PIP) -e .
	@touch $@

$(READY): $(INSTALLED)
	$(PIP) -e '.[dev]'
	@touch $@

run: $(INSTALLED) ## run the virtual operator on the Akwanga scenario; files in runs/akwanga
	$(BIN)/a7sim run scenarios/akwanga.toml --out runs/akwanga --force

test: $(READY) ## run all tests
	$(BIN)/python -m pytest --numprocesses 2 --dist loadgroup

lint: $(READY) ## check style, types and the direction of imports
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

generated: $(READY) ## make every generated page and picture anew (each is held fresh by a test)
	$(BIN)/python docs/make_exercise_scripts.py
	$(BIN)/python docs/make_protocol.py
	$(BIN)/python docs/make_python.py
	$(BIN)/python docs/make_reference.py
	$(BIN)/python -m docs.make_guide_pictures
	$(BIN)/python -m docs.make_tutorial_pictures

bench: $(READY) ## run every benchmark, about ten minutes, into docs/benchmarks.md (BENCH=--full: an hour and more)
	$(BIN)/python benchmarks/bench.py $(BENCH)

docs: $(VENV)/.docs-ready ## build the documentation into site/; nothing in it asks the network
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet

$(VENV)/.docs-ready: $(READY)
	$(PIP) -e '.[docs]'
	@touch $@

clean: ## remove what make made
	rm -rf $(VENV) runs site .pytest_cache .mypy_cache .ruff_cache .hypothesis
