# Any Python from 3.11 on will do; `make PYTHON=/path/to/python3.12 demo` names one.
NEW_ENOUGH := import sys; sys.exit(sys.version_info < (3, 11))
PYTHON ?= $(shell for python in python3 python3.11 python3.12 python3.13; do \
	$$python -c '$(NEW_ENOUGH)' 2>/dev/null && echo $$python && break; done)
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
READY_TO_DEVELOP := $(VENV)/.ready-to-develop
WARM := $(VENV)/.warm
# Python compiles a module to bytecode where it is first imported: most of those installed never are.
PIP := $(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt
CODE := coop_drake tests benchmarks notebooks docs paper
# The kernels are small; threads of BLAS would only get into each other's way.
export OMP_NUM_THREADS ?= 1
# Where nothing may be written, every process of a test would compile the package, and pytest all tests.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: environment warm demo test test-slow test-all lint lint-types lint-rest bench campaigns notebooks docs gallery clean

environment: $(READY_TO_DEVELOP)  ## set up what developing takes

warm: $(WARM)  ## compile what commands call first

demo: $(WARM)  ## plan, simulate and record the paper's transport
	$(BIN)/coop-drake run models/base.scenario.yaml

test: $(READY_TO_DEVELOP) $(WARM)  ## run all tests but the slow ones
	$(BIN)/python -m pytest -n 2 --dist worksteal -m "not slow"

# Some of them wait for processes that they ended or stopped; files without slow tests are not read.
test-slow: $(READY_TO_DEVELOP) $(WARM)  ## run the slow tests
	$(BIN)/python -m pytest -n 3 --dist worksteal -m slow $$(grep -rl mark.slow tests --include='test_*.py')

test-all: $(READY_TO_DEVELOP) $(WARM)  ## run every test, and show which lines none of them runs
	$(BIN)/python -m pytest -n 2 --dist worksteal --cov --cov-report=term-missing

lint: $(READY_TO_DEVELOP)  ## formatting, lint, types, direction of imports, documentation; two of them at a time
	@$(MAKE) --no-print-directory --jobs=2 --output-sync lint-types lint-rest

lint-types: $(READY_TO_DEVELOP)
	$(BIN)/mypy

lint-rest: $(READY_TO_DEVELOP)
	$(BIN)/ruff format --check $(CODE)
	$(BIN)/ruff check $(CODE)
	$(BIN)/lint-imports
	$(BIN)/python -m docs.generate out/docs

bench: $(READY_TO_DEVELOP)  ## measure speed and accuracy as ratios, into out/bench.json
	$(BIN)/python -m benchmarks

campaigns: $(READY_TO_DEVELOP)  ## make the documentation's campaigns, or the rest of them, and print their tables
	$(BIN)/python -m benchmarks.campaigns

docs: $(READY_TO_DEVELOP)  ## build the documentation into out/docs, warnings being errors
	$(BIN)/python -m docs.generate out/docs

gallery: $(READY_TO_DEVELOP)  ## run and photograph the galleries' transports, which `make docs` then shows
	$(BIN)/python -m docs.gallery out/gallery

notebooks: $(READY_TO_DEVELOP)  ## execute every notebook into out/notebooks, and build the documentation with them
	$(BIN)/python -m notebooks out/notebooks
	$(BIN)/python -m docs.generate out/docs --notebooks out/notebooks

$(READY): pyproject.toml constraints.txt
	@test -n "$(PYTHON)" || { echo "coop_drake needs Python 3.11 or newer; name one with make PYTHON=..." >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(PIP) -e .
	touch $@

$(WARM): $(READY)
	-$(BIN)/coop-drake doctor --warm
	touch $@

# What running takes is installed first, so that `make demo` does not wait for what developing takes. The package
# itself is there by then, and is not built again.
$(READY_TO_DEVELOP): $(READY)
	$(PIP) 'coop-drake[dev,bench]'
	touch $@

clean:  ## remove the environment and everything generated
	rm -rf $(VENV) out
