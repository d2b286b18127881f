# focgen: two commands are enough, `make demo` and `make test`.
PYTHON ?= python3
VENV   := .venv
RUN    := $(VENV)/bin/python
JOBS   ?= 2

.PHONY: help demo test test-long bench clean
.DEFAULT_GOAL := help

help:            ## this list
	@grep -E '^[a-z-]+: .*##|^[a-z-]+:  *##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*##/\t/' | expand -t 14

$(VENV)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[plots]'
	@touch $@

$(VENV)/ready-test: $(VENV)/ready
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@

demo: $(VENV)/ready            ## the whole chain on the example logs, into build/demo/
	$(RUN) -m focgen demo --out build/demo

test: $(VENV)/ready-test       ## what continuous integration runs
	$(RUN) -m pytest -n $(JOBS) -q

test-long: $(VENV)/ready-test  ## the suites that take minutes
	$(RUN) -m pytest -n $(JOBS) -q -m long

$(VENV)/ready-bench: $(VENV)/ready-test
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[bench]'
	@touch $@

bench: $(VENV)/ready-bench     ## speed and bias, side by side with their rivals
	$(RUN) -m tests.bench

clean:                         ## remove everything that was built
	rm -rf $(VENV) build
