# Everything runs in .venv, which the first target that needs it makes.
VENV := .venv
BIN := $(VENV)/bin
PIP_INSTALL := $(BIN)/python -m pip install -qq --disable-pip-version-check --no-input --progress-bar off
WORKERS ?= 2
HOST ?= 127.0.0.1
PORT ?= 8000
OUT ?= out/demo
ARGS ?=

.DEFAULT_GOAL := help
.PHONY: help demo serve train test lint docs bench clean

help: ## show this
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /  make \1\t/' | expand -t 16

demo: $(VENV)/.installed ## start the service, screen two real blades through it, write charts to out/demo
	@$(BIN)/rubscreen demo --out $(OUT)

serve: $(VENV)/.installed ## run the service (HOST=127.0.0.1 PORT=8000)
	@$(BIN)/rubscreen serve --host $(HOST) --port $(PORT)

train: $(VENV)/.installed ## train a surrogate (ARGS="--help" for the options)
	@$(BIN)/rubscreen train $(ARGS)

test: $(VENV)/.installed-test ## run the tests (WORKERS=2)
	@OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n $(WORKERS) $(ARGS)

lint: $(VENV)/.installed-dev ## check style, formatting and types
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

docs: $(VENV)/.installed-docs ## write the documentation site to out/docs, warnings are errors
	@OMP_NUM_THREADS=1 $(BIN)/python -m sphinx -q -W --keep-going -b html -d out/doctrees docs out/docs $(ARGS)
	@echo "open out/docs/index.html"

bench: $(VENV)/.installed-bench ## measure against peers (ARGS="accuracy speed" for the other measurements)
	@$(BIN)/python -m benchmarks $(ARGS)

clean: ## remove the environment, caches and outputs
	@rm -rf $(VENV) build dist out .mypy_cache .ruff_cache .pytest_cache .hypothesis *.egg-info
	@find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	@for python in $(PYTHON) python3.11 python3; do \
	  if "$$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	    echo "making $(VENV) with $$("$$python" --version)"; \
	    exec "$$python" -m venv $(VENV); \
	  fi; \
	done; \
	echo "Python 3.11 or later is needed: make PYTHON=path/to/python ..." >&2; exit 2

$(VENV)/.installed: pyproject.toml | $(BIN)/python
	@echo "installing rubscreen (the first time takes minutes: torch is large)"
	@$(PIP_INSTALL) --editable .
	@touch $@

$(VENV)/.installed-test: pyproject.toml | $(BIN)/python
	@echo "installing rubscreen and what its tests need"
	@$(PIP_INSTALL) --editable '.[test]'
	@touch $(VENV)/.installed $@

$(VENV)/.installed-dev: pyproject.toml | $(BIN)/python
	@echo "installing rubscreen and what its development needs"
	@$(PIP_INSTALL) --editable '.[dev]'
	@touch $(VENV)/.installed $(VENV)/.installed-test $@

$(VENV)/.installed-docs: pyproject.toml | $(BIN)/python
	@echo "installing rubscreen and what its documentation needs"
	@$(PIP_INSTALL) --editable '.[docs]'
	@touch $(VENV)/.installed $@

$(VENV)/.installed-bench: pyproject.toml | $(BIN)/python
	@echo "installing rubscreen and the peers it is measured against"
	@$(PIP_INSTALL) --editable '.[bench]'
	@touch $(VENV)/.installed $@
