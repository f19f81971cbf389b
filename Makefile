# `make test` and `make study` set up what they need: a virtual environment in .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RECORDS ?= $(wildcard ../shared/benchmark)
STAMP := $(VENV)/.installed

.PHONY: help test test-all study lint format clean

help:  ## Show what there is to make.
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@

TESTS := $(BIN)/python -m pytest --numprocesses auto --dist loadfile

test: $(STAMP)  ## Check the style and run the tests; the slow ones too where CI is set.
	$(BIN)/ruff check .
	$(TESTS)

test-all: $(STAMP)  ## Check the style and run all tests, as CI does.
	$(BIN)/ruff check .
	$(TESTS) --all

study: $(STAMP)  ## The study: 1000 uncertain plants, three motions, two controllers.
	$(BIN)/martths study $(if $(RECORDS),--records $(RECORDS)) --out runs/study

lint: $(STAMP)  ## Check the style.
	$(BIN)/ruff check .

format: $(STAMP)  ## Format the code.
	$(BIN)/ruff format .

clean:  ## Remove the virtual environment and caches.
	rm -rf $(VENV) build *.egg-info .pytest_cache .ruff_cache .hypothesis
