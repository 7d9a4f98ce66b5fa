# Two commands do everything: `make fly` and `make test`. Both set up what they need first, once.
# They need Python 3.11 or later with venv and pip, and reach for nothing outside this folder.

PYTHON ?= python3
VENV := .venv
MAVPROXY_VENV := .venv-mavproxy
BENCH_VENV := .venv-bench
NODE_MODULES := web/node_modules/.package-lock.json
BIN := $(VENV)/bin
ROOMS := scenarios firmware_py sitl vision offboard framerunner
LOCK := uv pip compile --universal --python-version 3.11 --generate-hashes --quiet --custom-compile-command 'make lock'
LOCK_PROJECT := $(LOCK) pyproject.toml locks/build.in
# Everything but this project has a hash and is refused if it differs; the folder itself can have none.
INSTALL_LOCKED := $(BIN)/pip install --require-hashes --requirement
INSTALL_PROJECT := $(BIN)/pip install --no-deps --no-build-isolation --editable .

# The tests start hundreds of processes; without stored bytecode each of them compiles the project again.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
# Only `test` has several targets made at once, those that do not disturb each other.
ifndef AT_ONCE
.NOTPARALLEL:
endif

.PHONY: help
help: ## say what can be made
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-14s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.PHONY: fly
fly: $(VENV)/installed ## set up and fly test case 1; the result is left in runs/
	$(BIN)/framerunner fly test-case-1

.PHONY: setup
setup: $(VENV)/installed-dev $(MAVPROXY_VENV)/installed ## set up for development, without running anything

.PHONY: test
test: test-set-up test-checks test-together test-front test-realtime-alone ## set up, then run all checks and all tests

# What is made at once shows its output when it is complete.
AT_ONCE_FLAGS = --output-sync=target -j2 AT_ONCE=yes

.PHONY: test-set-up test-checks test-together test-collect
test-set-up:
	$(MAKE) $(AT_ONCE_FLAGS) setup web-check

test-checks:
	$(MAKE) $(AT_ONCE_FLAGS) lint test-collect

test-together: # flights in real time use a third of two processors; other tests get what they leave
	$(MAKE) $(AT_ONCE_FLAGS) test-realtime-shared test-core

# Each worker of pytest reads all tests; once they have been read, what they are compiled to is stored.
test-collect: $(VENV)/installed-dev
	@out=$$($(BIN)/pytest --collect-only --quiet 2>&1) || { echo "$$out"; exit 1; }

.PHONY: lint lint-code lint-format lint-types lint-rooms lint-web
lint: lint-code lint-format lint-types lint-rooms lint-web ## ruff, mypy, the rules between the rooms; eslint and tsc

lint-code: $(VENV)/installed-dev
	$(BIN)/ruff check .

lint-format: $(VENV)/installed-dev
	$(BIN)/ruff format --check .

lint-types: $(VENV)/installed-dev
	$(BIN)/mypy

lint-rooms: $(VENV)/installed-dev
	$(BIN)/lint-imports

# The pages' scripts are checked and bundled by Node.js, which only those need who change them.
IF_NODE = command -v npm >/dev/null || { echo "Node.js is not installed; skipped: $@"; exit 0; };
NPM_CI = npm ci --ignore-scripts --no-audit --no-fund

lint-web:
	@$(IF_NODE) $(MAKE) --silent $(NODE_MODULES) && cd web && npm run --silent lint && npm run --silent types

.PHONY: web web-check page-types
page-types: $(VENV)/installed-dev ## write the types of the pages' messages, web/src/lib/messages.d.ts, from their models
	$(BIN)/python web/page_types.py

web: $(NODE_MODULES) ## bundle the monitor's pages, web/, into framerunner/monitor/static/ (needs Node.js 20)
	cd web && npm run --silent build

web-check: ## bundle them with packages installed anew; the result must be what is committed
	@$(IF_NODE) cd web && $(NPM_CI) && npm run --silent build -- ../build/web-check \
		&& { diff -r ../build/web-check ../framerunner/monitor/static || { echo "framerunner/monitor/static/ is not what web/ gives; run: make web"; exit 1; }; }

.PHONY: test-ardupilot
test-ardupilot: $(VENV)/installed-dev ## fly the challenge on a genuine ArduCopter: ARDUPILOT_DIR=its folder
	@if [ -z "$(ARDUPILOT_DIR)" ]; then echo "no ArduPilot: give its folder, built for SITL, by ARDUPILOT_DIR=../ardupilot"; exit 1; fi
	ARDUPILOT_DIR=$(abspath $(ARDUPILOT_DIR)) $(BIN)/pytest -rs tests/sitl/ardupilot/test_genuine.py

.PHONY: test-fast
test-fast: $(VENV)/installed-dev ## the tests that need no real time, in parallel
	$(FAST)

# `test` runs them in two parts; those of the second use browsers and several processes.
FAST = $(BIN)/pytest -n 4 --dist worksteal -m "not realtime"
CORE = $(addprefix tests/,framerunner/geometry framerunner/vehicle framerunner/wire scenarios firmware_py vision sitl offboard)

.PHONY: test-core test-front
test-core: $(VENV)/installed-dev
	nice -n 15 $(BIN)/pytest -n 2 --dist worksteal -m "not realtime" $(CORE)

test-front: $(VENV)/installed-dev
	$(FAST) $(addprefix --ignore=,$(CORE))

.PHONY: test-realtime test-realtime-shared test-realtime-alone
test-realtime: test-realtime-shared test-realtime-alone ## the tests that fly in real time
test-realtime-%: export FRAMERUNNER_MAVPROXY := $(abspath $(MAVPROXY_VENV)/bin/mavproxy.py)

# Its workers have other ports than those of test-core.
test-realtime-shared: export FRAMERUNNER_TEST_FIRST_WORKER := 3
test-realtime-shared: setup
	$(BIN)/pytest -n 3 --dist loadgroup -m "realtime and not alone" tests/offboard tests/realtime

test-realtime-alone: setup
	$(BIN)/pytest -m alone tests/realtime

.PHONY: test-px4
test-px4: $(VENV)/installed-dev ## fly a genuine PX4 in the simulated world: make test-px4 PX4_DIR=../PX4-Autopilot
	@if [ -z "$(PX4_DIR)" ]; then echo "no PX4: give its folder, built for SITL, by PX4_DIR=../PX4-Autopilot"; exit 1; fi
	FRAMERUNNER_PX4_DIR=$(abspath $(PX4_DIR)) $(BIN)/pytest -rs tests/sitl/px4/test_genuine.py

.PHONY: bench
bench: $(VENV)/installed ## time our flight, alone and beside MuJoCo and PyFlyt; options in BENCH="--peers none"
	$(BIN)/python -m benchmarks $(BENCH)

.PHONY: docs docs-links
SPHINX = $(BIN)/sphinx-build --quiet --fresh-env --fail-on-warning --keep-going
MERMAID_VERSION = 11.17.2
MERMAID_SHA256 = 6ad2f42c3fc26bbf9e45cbb6d11898972573ea52b33a5f4ff51952899f950ffd
MERMAID = build/mermaid-$(MERMAID_VERSION)
docs: $(VENV)/installed-dev ## build the documentation with search and API reference: build/docs/index.html
	@$(IF_NODE_DRAWS) $(MAKE) --silent $(MERMAID)/mermaid.min.js
	FRAMERUNNER_MERMAID=$(abspath $(MERMAID)) $(SPHINX) --builder html docs build/docs
	@echo "open build/docs/index.html in a browser"

IF_NODE_DRAWS = command -v npm >/dev/null || { echo "Node.js is not installed; diagrams are shown as text"; exit 0; };
# The package's bundle needs no other file, so that the pages draw diagrams without a network, also from a disk.
$(MERMAID)/mermaid.min.js:
	mkdir -p $(MERMAID)
	npm pack --silent --pack-destination build mermaid@$(MERMAID_VERSION) > build/mermaid.txt
	cd build && echo "$(MERMAID_SHA256)  $$(cat mermaid.txt)" | sha256sum --check --quiet
	tar --extract --gzip --touch --file build/$$(cat build/mermaid.txt) --directory $(MERMAID) --strip-components 2 package/dist/mermaid.min.js

docs-links: $(VENV)/installed-dev ## ask the web whether every address in the documentation exists
	$(SPHINX) --builder linkcheck docs build/docs-links

.PHONY: parameters
parameters: $(VENV)/installed-dev ## write docs/parameters.md from the declarations
	$(BIN)/python -m firmware_py.parameters.reference > docs/parameters.md

.PHONY: failsafes
failsafes: $(VENV)/installed-dev ## write the tables of failsafes in the documents from their data
	$(BIN)/python -m offboard.safety.failsafes

.PHONY: result-schema
result-schema: $(VENV)/installed-dev ## write docs/result.schema.json again from the type FlightResult
	$(BIN)/python -m scenarios.result > docs/result.schema.json

.PHONY: reference-flights
reference-flights: $(VENV)/installed-dev ## store again the flights that tests compare with
	$(BIN)/python -m tests.framerunner.reference_flights

.PHONY: format
format: $(VENV)/installed-dev ## write the code as the checks want it
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

.PHONY: hooks
hooks: $(VENV)/installed-dev ## check every commit before it is made
	$(BIN)/pre-commit install

.PHONY: lock
lock: ## choose newer versions of everything installed (needs uv)
	$(LOCK_PROJECT) --upgrade --extra dev -o locks/dev.txt
	$(LOCK_PROJECT) --constraint locks/dev.txt -o locks/small.txt
	$(LOCK_PROJECT) --constraint locks/dev.txt --extra all -o locks/framerunner.txt
	$(LOCK_PROJECT) --constraint locks/dev.txt --extra all --extra dask --extra gym --extra postgresql -o locks/extras.txt
	$(LOCK) --upgrade locks/mavproxy.in --override locks/mavproxy-without.txt -o locks/mavproxy.txt

.PHONY: check-pi
check-pi: $(VENV)/installed-dev ## ask the registry whether a Raspberry Pi can install it without a compiler
	$(BIN)/python -m tests.locks.check_wheels locks/framerunner.txt

.PHONY: release-check release-sizes
release-check: $(VENV)/installed-dev ## build the wheel, install it on each Python at hand, fly, run the examples
	$(BIN)/python -m tests.release.check $(RELEASE)

release-sizes: $(VENV)/installed-dev ## measure dependencies and extras for docs/installation.md
	$(BIN)/python -m tests.release.check --sizes

.PHONY: clean
clean: ## remove what was installed and built; runs/ is kept
	rm -rf $(VENV) $(MAVPROXY_VENV) $(BENCH_VENV) web/node_modules build dist *.egg-info
	rm -rf .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis
	find $(ROOMS) benchmarks tests -name __pycache__ -type d -prune -exec rm -rf {} +

# Set-up is repeated when what it was made from has changed; the stamp files remember when it was done.

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
		echo "framerunner needs Python 3.11 or later; this is $$($(PYTHON) --version). Try: make PYTHON=python3.12 $(MAKECMDGOALS)"; \
		exit 1; }
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
		echo "Python could not make a virtual environment. On Debian and Ubuntu: sudo apt install python3-venv"; \
		exit 1; }

$(VENV)/installed: $(BIN)/python pyproject.toml locks/framerunner.txt
	$(INSTALL_LOCKED) locks/framerunner.txt
	$(INSTALL_PROJECT)
	@touch $@

$(VENV)/installed-dev: $(BIN)/python pyproject.toml locks/dev.txt
	$(INSTALL_LOCKED) locks/dev.txt
	$(INSTALL_PROJECT)
	@touch $@ $(VENV)/installed

$(NODE_MODULES): web/package.json web/package-lock.json
	cd web && $(NPM_CI)
	@touch $@

$(MAVPROXY_VENV)/installed: $(BIN)/python locks/mavproxy.txt
	$(BIN)/python -m venv $(MAVPROXY_VENV)
	$(MAVPROXY_VENV)/bin/pip install --no-deps --require-hashes --requirement locks/mavproxy.txt
	@touch $@
