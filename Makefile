PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: demo test lint bench notebooks clean

demo: $(READY)  ## plan, simulate and record the paper's transport
	$(BIN)/coop-drake run models/base.scenario.yaml

test: $(READY)  ## run every test
	$(BIN)/python -m pytest -n 2

lint: $(READY)  ## formatting, lint, types, direction of imports
	$(BIN)/ruff format --check coop_drake tests notebooks
	$(BIN)/ruff check coop_drake tests notebooks
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(READY)  ## measure speed and accuracy as ratios, into out/bench.json
	$(BIN)/python -m benchmarks

notebooks: $(READY)  ## execute every notebook in place under out/notebooks
	$(BIN)/python -m notebooks out/notebooks

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "coop_drake needs Python 3.11 or newer; set PYTHON=python3.11")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev,bench]'
	touch $@

clean:  ## remove the environment and everything generated
	rm -rf $(VENV) out
