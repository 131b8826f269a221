# make bench    play the bundled suite with the oracle and the random agent, and print the table
# make test     run the tests, several at a time; one process: make test ARGS=-n0
# make lint     check style and types
# make check    lint, then test
# make docs     build the documentation site in build/docs; open build/docs/index.html
# make cover    run the tests and say which lines they do not reach (half as slow again)
# make test-inspect   run the tests of er-gym inspect, with the extra that they need
# make test-triton    run the tests of the kernels for a GPU, with Triton beside the environment
# make clean    remove what these left behind, the virtual environment included; runs/ stays
#
# Each does the set-up that it needs in $(VENV), once. Another Python: make bench PYTHON=python3.12

PYTHON ?= python3
VENV ?= .venv
WORKERS ?= 2

# Without bytecode every worker process of the tests would compile torch and its like again.
unexport PYTHONDONTWRITEBYTECODE

BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
# Python compiles what it imports; compiling all of it beforehand only takes time.
INSTALL := $(PIP) install --quiet --no-compile --constraint constraints.txt
# On a terminal, says for how long a quiet command has run, and how many packages there are.
SHOWN := $(PYTHON) -m benchmarks.checks.shown
MARK := $(VENV)/.er-gym

.PHONY: bench test docs test-inspect test-triton cover lint check clean help
.DELETE_ON_ERROR:

help:
	@sed -n 's/^# \(make .*\)/\1/p' Makefile

bench: $(MARK)-core
	$(BIN)/er-gym bench --suite mini --agent oracle --workers $(WORKERS) --out runs/mini-oracle
	$(BIN)/er-gym bench --suite mini --agent random --workers $(WORKERS) --out runs/mini-random
	$(BIN)/er-gym report runs/mini-oracle runs/mini-random

test: $(MARK)-dev
	$(BIN)/python -m pytest $(ARGS)

docs: $(MARK)-docs
	$(BIN)/python -m sphinx -q -W --keep-going -b html docs build/docs
	@echo build/docs/index.html

cover: $(MARK)-dev
	$(BIN)/python -m pytest --cov --cov-report=term-missing:skip-covered $(ARGS)

test-inspect: $(MARK)-dev
	@$(SHOWN) 'Installing Inspect in $(VENV)' $(VENV) $(INSTALL) --editable '.[dev,inspect]'
	$(BIN)/python -m pytest tests/benchmarks/test_inspect_task.py $(ARGS)

# Beside the environment: torch imports Triton wherever it finds it, and some releases of Triton
# print lines at the end of every program.
test-triton: $(MARK)-dev
	$(BIN)/python -m pip install --quiet --upgrade --no-deps --target build/triton triton
	PYTHONPATH=build/triton $(BIN)/python -m pytest -n 0 tests/agents/vlm/test_triton_attention.py \
	  tests/agents/vlm/test_kv_cache.py::test_replies_are_the_same_with_the_kernels_for_a_gpu $(ARGS)

check: lint test

lint: $(MARK)-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

clean:
	rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache build dist
	find . -name __pycache__ -not -path './.git/*' -prune -exec rm -rf {} +

$(MARK)-core: pyproject.toml constraints.txt | $(BIN)/python
	@$(SHOWN) 'Installing er-gym in $(VENV), once' $(VENV) $(INSTALL) --editable .
	@touch $@

$(MARK)-dev: pyproject.toml constraints.txt | $(BIN)/python
	@$(SHOWN) 'Installing er-gym and what its tests need in $(VENV), once' $(VENV) \
	  $(INSTALL) --editable '.[dev]'
	@touch $(MARK)-core $@

$(MARK)-docs: pyproject.toml constraints.txt | $(BIN)/python
	@$(SHOWN) 'Installing er-gym and what its documentation needs in $(VENV), once' $(VENV) \
	  $(INSTALL) --editable '.[docs,vlm,mcp]'
	@touch $(MARK)-core $@

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || { \
	  echo "er-gym needs Python 3.10 or newer, and $(PYTHON) is not one; name one: make PYTHON=python3.12" >&2; \
	  exit 2; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "$(PYTHON) cannot make virtual environments; on Debian or Ubuntu: sudo apt install python3-venv" >&2; \
	  exit 2; }
	@$(SHOWN) 'Making $(VENV)' $(VENV) $(PYTHON) -m venv $(VENV)
