# focgen: two commands are enough, `make demo` and `make test`.
PYTHON ?= python3
VENV   := .venv
RUN    := $(VENV)/bin/python
JOBS   ?= 2
FUZZ_SECONDS ?= 600
FOLDERS ?= focgen

.PHONY: help demo test test-long test-pythons types lint house slowest docs bench trials trial-cases trial-report foreign records prove fuzz fuzz-c fuzz-inputs trust trust-lost equality mutants coverage matrix lock headers clean
.DEFAULT_GOAL := help

help:            ## this list
	@grep -E '^[a-z-]+: .*##|^[a-z-]+:  *##' $(MAKEFILE_LIST) | sed -E 's/:[^#]*##/\t/' | expand -t 14

$(VENV)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[plots,report]'
	@touch $@

$(VENV)/ready-test: $(VENV)/ready
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@

demo: $(VENV)/ready            ## the whole chain on the example logs, into build/demo/
	$(RUN) -m focgen demo --out build/demo --force

# Several processes share the cores: one that spreads its sums over all of them waits for the others.
test test-long: export OMP_NUM_THREADS = 1

test: $(VENV)/ready-test       ## what continuous integration runs
	$(RUN) -m pytest -n $(JOBS) --dist worksteal -q $(TESTS)

# PYTHONS may name others, by path too; TESTS what to run of the suite.
PYTHONS ?= python3.11 python3.12 python3.13 python3.14
TESTS   ?=

test-pythons:                  ## the same by every Python from 3.11 on that is installed, each in build/python/
	@for python in $(PYTHONS); do \
	  command -v $$python > /dev/null || { echo "$$python: not installed"; continue; }; \
	  name=$$($$python -c 'import sys; print("%d.%d" % sys.version_info[:2])') && \
	  $(MAKE) test PYTHON=$$python VENV=build/python/$$name || exit 1; \
	done

test-long: $(VENV)/ready-dev   ## the suites that take minutes
	$(RUN) -m pytest -n $(JOBS) --dist worksteal -q -m long

$(VENV)/ready-dev: $(VENV)/ready-test
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

types: $(VENV)/ready-dev       ## what users call and get, by a strict checker of types
	$(RUN) -m mypy

lint: $(VENV)/ready-dev        ## rules of style and likely faults, and the form of every file
	$(RUN) -m ruff check focgen tests tools
	$(RUN) -m ruff format --check focgen tests tools

house: $(VENV)/ready-dev       ## lengths and complexity of functions, longest file, what a strict checker finds
	$(RUN) tools/house.py --types --most 5 $(FOLDERS)

slowest: $(VENV)/ready-test    ## the ten slowest tests (the whole suite, by one process)
	OMP_NUM_THREADS=1 $(RUN) -m pytest -q --durations=10 $(TESTS) | sed -n '/slowest/,$$p'

$(VENV)/ready-docs: $(VENV)/ready
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@touch $@

docs: $(VENV)/ready-docs       ## the documentation as a site that needs no server, into build/site/
	$(RUN) tools/make_docs.py build/site
	@echo "open build/site/index.html"

$(VENV)/ready-bench: $(VENV)/ready-test
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[bench]'
	@touch $@

bench: $(VENV)/ready-bench     ## speed and bias, side by side with their rivals
	$(RUN) -m tests.bench

# The diagnosis judged blind. CASES a set, SUITES, SIGNALS and SEED may be given; `make trials MINUTES=50` stops
# beginning cases after 50 minutes, a further `make trials` goes on, and the table says how many were counted.
CASES   ?= 200
SEED    ?= 1000
SIGNALS ?= C B A
SUITES  ?= full short closed
MINUTES ?= 100000
TRIALS  := build/trials
SETS     = $(foreach suite,$(SUITES),$(foreach s,$(SIGNALS),$(TRIALS)/$(s)_$(suite)))

$(VENV)/ready-engine: $(VENV)/ready
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[engine]'
	@touch $@

$(TRIALS)/%_engine/trial.json: | $(VENV)/ready-engine
	$(RUN) -m focgen trial make $(TRIALS)/$*_engine --signals $* --suite engine --cases $(CASES) --seed $(SEED)

$(TRIALS)/%/trial.json: | $(VENV)/ready
	$(RUN) -m focgen trial make $(TRIALS)/$* --signals $(firstword $(subst _, ,$*)) \
	  --suite $(lastword $(subst _, ,$*)) --cases $(CASES) --seed $(SEED)

trial-cases: $(addsuffix /trial.json,$(SETS))  ## sealed cases for `make trials`, into build/trials/

trials: trial-cases            ## sealed cases diagnosed blind, then the table of scores (hours; can be resumed)
	-$(RUN) -m focgen trial run $(SETS) --jobs $(JOBS) --minutes $(MINUTES)
	$(MAKE) trial-report

trial-report: $(VENV)/ready    ## the table of what `make trials` has diagnosed so far
	$(RUN) -m focgen trial score $(SETS) --partial --oracle --jobs $(JOBS) --out $(TRIALS)/table

foreign: $(VENV)/ready-test    ## what the diagnosis says of another simulator's rigs, a table (an hour of one core)
	OMP_NUM_THREADS=1 $(RUN) -m tests.foreign

records: export OMP_NUM_THREADS = 1

# Public benchmarks; their data are no part of the project: FOCGEN_DATA names the folder that holds them.
records: $(VENV)/ready-test    ## public benchmarks: diagnosed, and replayed on their tests (FOCGEN_DATA=folder)
	$(RUN) -m tests.records

$(VENV)/ready-prove: $(VENV)/ready-test
	$(RUN) -m pip install --quiet --disable-pip-version-check --editable '.[prove]'
	@touch $@

prove: $(VENV)/ready-prove     ## no overflow, no access outside, by the verifiers that are installed
	$(RUN) -m tests.proofs

fuzz: fuzz-c fuzz-inputs        ## both of the next two, FUZZ_SECONDS=600 each; hours find more

fuzz-c: $(VENV)/ready-test     ## led random calls of generated C under the sanitisers (needs clang)
	$(RUN) -m tests.proofs.fuzz --seconds $(FUZZ_SECONDS)

# Corpus, counts and what is found stay in build/fuzz/: a further run goes on. Python 3.12 leads five times as fast.
fuzz-inputs: $(VENV)/ready-test  ## led mutations of logs, TOML, JSON, folders and command lines
	OMP_NUM_THREADS=1 $(RUN) -m tests.fuzz --seconds $(FUZZ_SECONDS)

# SECONDS that each fault lasts, RUNS from seeds of their own, MEMORY short or exponential.
SECONDS ?= 180
RUNS    ?= 3
MEMORY  ?= short

trust: $(VENV)/ready-test      ## generated C in a loop under faults, a table (SECONDS=180 RUNS=3 MEMORY=short)
	OMP_NUM_THREADS=1 $(RUN) -m tests.trust --seconds $(SECONDS) --runs $(RUNS) --memory $(MEMORY)

KILLS ?= 200

trust-lost: $(VENV)/ready-test  ## every command killed at random, on a full disk, two at once: nothing is lost (KILLS=200)
	OMP_NUM_THREADS=1 $(RUN) -m tests.trust.lost --kills $(KILLS)

# A billion samples on the host and ten million on each emulated core take some hours of one core; a further
# `make equality` goes on where the last one ended.
SAMPLES      ?= 1e9
CONTROLLERS  ?= 2000
CORE_SAMPLES ?= 1e7

equality: $(VENV)/ready-test   ## C and reference over random controllers (SAMPLES=1e9 CONTROLLERS=2000 CORE_SAMPLES=1e7)
	OMP_NUM_THREADS=1 $(RUN) -m tests.equality --samples $(SAMPLES) --controllers $(CONTROLLERS) \
	  --core-samples $(CORE_SAMPLES)

# The tests are measured once (an hour of one core); then COUNT changes of the sources from SEED on, which can be
# resumed as well.
COUNT ?= 320

mutants: $(VENV)/ready-dev     ## one small change of the sources at a time: do the tests tell? (COUNT=320 SEED=1)
	OMP_NUM_THREADS=1 $(RUN) -m tests.mutants --count $(COUNT) --seed $(if $(filter file,$(origin SEED)),1,$(SEED))

coverage: $(VENV)/ready-dev    ## lines and branches that the suite runs, by room
	OMP_NUM_THREADS=1 $(RUN) -m coverage run -m pytest -q $(TESTS)
	$(RUN) tools/coverage_by_room.py

matrix: $(VENV)/ready-test     ## the same bytes by every Python, numpy, processor, locale … that there is here
	$(RUN) -m tests.matrix --folder build/matrix

lock:                          ## requirements/dev.lock anew: versions and hashes of what development needs (uv)
	uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 --generate-hashes \
	  --no-header --no-annotate --upgrade --quiet --output-file requirements/dev.lock

headers: $(VENV)/ready         ## what in the runtime is the same but for a type, printed from one source
	$(RUN) tools/twin_headers.py

clean:                         ## remove everything that was built
	rm -rf $(VENV) build
