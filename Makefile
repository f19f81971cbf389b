# `make test` and `make study` set up what they need: a virtual environment in .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RECORDS ?= $(wildcard ../shared/benchmark)
STAMP := $(VENV)/.installed

.PHONY: help test study lint format clean

help:  ## Show what there is to make.
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/'

$(STAMP): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@

test: $(STAMP)  ## Check the style and run all tests.
	$(BIN)/ruff check .
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile

study: $(STAMP)  ## The study: 1000 uncertain plants, three motions, two controllers.
	$(BIN)/martths study $(if $(RECORDS),--records $(RECORDS)) --out runs/study

lint: $(STAMP)  ## Check the style.
	$(BIN)/ruff check .

format: $(STAMP)  ## Format the code.
	$(BIN)/ruff format .

clean:  ## Remove the virtual environment and caches.
	rm -rf $(VENV) build *.egg-info .pytest_cache .ruff_cache .hypothesis
