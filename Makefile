# The commands of mavbridge. Each first runs the set-up steps that are out of date.

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help
.PHONY: help setup setup-dev setup-extras build setup-nav2 demo demo-rover demo-fleet demo-agent demo-nav2 demo-video console plot report test test-all test-arm64 test-kilted test-night explore bench shape lint lock pages wheels version clean distclean

# Prefix of commands that need the environment.
ENTER := source ./setup.bash &&

# Those of the simulator, which knows nothing of the rest, are in its own folder.
IMPORT_RULES := for project in . sitl; do \
	lint-imports --no-logo --config $$project/pyproject.toml --cache-dir .import_linter_cache; done

help: ## Show this list
	@grep -hE '^[a-z0-9-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z0-9-]+):.*## (.*)/\1\t\2/' | \
		while IFS=$$'\t' read -r name what; do printf 'make %-10s %s\n' "$$name" "$$what"; done

setup: ## Set up .venv and build the workspace (PYTHON=python3.12 chooses the interpreter)
	@scripts/setup.sh

setup-dev: ## The same, and what testing and developing need, on top
	@scripts/setup.sh --with dev

setup-extras: ## The same, and what bags, tables, ULog files, films and PMTiles need, on top
	@scripts/setup.sh --with extras

build: setup ## The same as setup

setup-nav2: ## The same as setup, and build the interfaces of Nav2 where ROS has none
	@scripts/setup.sh --with nav2_msgs

demo: setup ## Fly a copter round obstacles in the simulator; leaves out/demo/
	@$(ENTER) python -m drone_navigation.demo

demo-rover: setup ## The same with a rover; leaves out/demo-rover/
	@$(ENTER) python -m drone_navigation.demo --vehicle rover --out out/demo-rover

demo-fleet: setup-dev ## Fly eight copters through one point, one of them paused; leaves out/demo-fleet/
	@$(ENTER) python -m tests.fleets.demo

demo-agent: setup-dev ## Have an agent rejected, then confirmed and flown; leaves a film in out/demo-agent/
	@$(ENTER) python -m tests.agents.demo

demo-nav2: setup-nav2 ## Offer a simulated vehicle to clients of Nav2 (ARGS="--vehicle rover")
	@$(ENTER) python -m drone_navigation.demo_nav2 $(ARGS)

demo-video: setup-extras ## Make out/demo/flight.mp4 and .gif from the demo's recording (LOG=other.tlog)
	@$(ENTER) python -m flight_reports.flight_video $(LOG)

console: setup ## Fly a simulated copter from a page in the browser (ARGS="--no-browser --port 8800")
	@$(ENTER) python -m drone_navigation.simulated_console $(ARGS)

plot: setup ## Draw the flight in any tlog: make plot LOG=my.tlog (draws my.png)
	@test -n "$(LOG)" || { echo "Name the log: make plot LOG=my.tlog" >&2; exit 2; }
	@$(ENTER) python -m flight_reports.flight_plot "$(LOG)"

report: setup ## Explain a flight on one HTML page: make report LOG=my.tlog (writes my.html)
	@test -n "$(LOG)" || { echo "Name the log: make report LOG=my.tlog" >&2; exit 2; }
	@$(ENTER) python -m flight_reports.navigation_report "$(LOG)"

# The ROS tests mostly wait, so there are more processes than cores. Each would compile all sources
# if the result were not kept. A process that ends is not replaced: pytest-xdist 3.8 then waits
# without end for tests that it gave to nobody.
PYTEST := env -u PYTHONDONTWRITEBYTECODE \
	python -m pytest --dist loadgroup --max-worker-restart 0

# What takes long is seen before it adds up, and whether tests wait or the processors decide.
SLOWEST := --durations 40 --durations-min 8
TIMED = TIMEFORMAT="$(1): %R s, %P %% of one processor." && time

TESTS := tests sitl/tests
IN_REAL_TIME := tests/bench tests/interop sitl/tests/interop tests/ros \
	tests/unit/test_make_targets.py \
	$(addprefix tests/pair/test_,hostile_stations.py signing.py station_beside_bridge.py)

test: setup-dev ## Run the tests, all but the slow and broad ones
	@$(ENTER) $(IMPORT_RULES)
	@$(ENTER) $(call TIMED,The quick tests) $(PYTEST) -n 4 -m "not wide" $(TESTS)

# Tests that only compute take what those that wait for processes leave of the processors, and
# their output follows at the end. A shell lets what runs beside it ignore Ctrl-C, unless told.
test-all: setup-nav2 test ## Run the tests, and the slow and broad ones, too (a quarter of an hour)
	@$(ENTER) mkdir -p out; computed=out/test_all_computed.txt; status=0; \
	$(call TIMED,Tests that only compute) env --default-signal=INT nice -n 19 \
		$(PYTEST) -n 2 -m "wide and not night" $(SLOWEST) \
		$(TESTS) $(IN_REAL_TIME:%=--ignore=%) >$$computed 2>&1 & \
	$(call TIMED,Tests in real time) $(PYTEST) -n 5 -m "wide and not night" $(SLOWEST) \
		$(IN_REAL_TIME) || status=$$?; \
	wait $$! || status=$$?; \
	cat $$computed; \
	exit $$status

test-arm64: setup-dev ## Try the packages that need no ROS on ARM64, by emulation (ARGS=tests/unit/core)
	@$(ENTER) python scripts/try_arm64.py $(ARGS)

test-kilted: ## Run the tests that need ROS on ROS 2 Kilted, in out/kilted (ARGS="-k velocity tests/ros")
	@scripts/try_kilted.sh $(ARGS)

# Each night has layouts and seeds of its own.
NIGHT ?= $(shell date +%-j)
NIGHT_LAYOUTS ?= 200
NIGHT_SEEDS ?= 1000000

test-night: test-all test-arm64 test-kilted ## And those with all their parameters, layouts of boxes, an hour's exploration
	@$(ENTER) $(PYTEST) -n 4 -m night $(SLOWEST) $(TESTS)
	@$(ENTER) python -m tests.explore.boxes --layouts $(NIGHT_LAYOUTS) --first $$(($(NIGHT) * 200))
	@$(ENTER) python -m tests.explore --seeds $(NIGHT_SEEDS) --minutes 60 --first $$(($(NIGHT) * 1000000))

SEEDS ?= 200
FIRST ?= 0
WORKERS ?= 2

explore: setup-dev ## Fly SEEDS scenarios from FIRST on, with MINUTES at most that long, and check policies
	@$(ENTER) python -m tests.explore --seeds $(SEEDS) --first $(FIRST) --workers $(WORKERS) \
		$(if $(MINUTES),--minutes $(MINUTES))

bench: setup-dev ## Run the benchmarks; prints a table, writes out/bench.json (ARGS="--compare old.json")
	@$(ENTER) python tests/bench/run.py $(ARGS)

shape: setup-dev ## Print how far a turn of the bridge goes through the code, and figures of the source
	@$(ENTER) python -m tests.shape $(ARGS)

lint: setup-dev ## Check style, types and import rules
	@$(ENTER) ruff check .
	@$(ENTER) ruff format --check .
	@$(ENTER) mypy
	@$(ENTER) $(IMPORT_RULES)

# `uv pip compile` keeps locked versions; UPGRADE=--upgrade takes the newest. All that developing
# needs is resolved first, and the other locks take its versions. Only the build needs empy; lxml
# is for pymavlink's generator, setuptools for building. colcon-core asks for plugins of pytest that
# no build uses, and that would change every run of the tests.
LOCK := uv pip compile --universal --python-version 3.10 --generate-hashes --no-header \
	--no-emit-index-url --no-annotate --quiet --system-certs $(UPGRADE)

lock: setup-dev ## Write requirements/*.txt from pyproject.toml (UPGRADE=--upgrade takes the newest)
	@$(ENTER) for ros in wheels kilted system; do \
		running="--group runtime --group ros-$$ros --no-emit-package empy"; \
		light="--no-emit-package lxml --no-emit-package setuptools"; \
		extras="--group extras --group ros-$$ros-extras"; \
		unused=$$(printf ' --no-emit-package %s' coverage pytest-{cov,repeat,rerunfailures}); \
		at=requirements/$$ros; \
		$(LOCK) $$running $$extras --group dev $$unused -o $$at-dev.txt; \
		$(LOCK) $$running $$light $$extras -c $$at-dev.txt -o $$at-extras.txt; \
		$(LOCK) $$running $$light -c $$at-dev.txt -o $$at.txt; \
		$(LOCK) --group build --group ros-$$ros --group ros-$$ros-build -c $$at-dev.txt \
			-o $$at-build.txt; \
	done

pages: setup-dev ## Write the pages of parameters and simulated firmwares, the schema, and the types of messages
	@$(ENTER) python scripts/list_parameters.py
	@$(ENTER) python scripts/write_dialect_stub.py
	@$(ENTER) python sitl/scripts/list_simulated.py

wheels: setup-dev ## Build wheels in dist/: the packages that need no ROS, and the interfaces
	@$(ENTER) python scripts/make_wheels.py --interfaces

version: ## Write the version in VERSION to all packages
	@python3 scripts/set_version.py

clean: ## Remove build results and outputs; keeps the installed packages
	rm -rf build dist install log out .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache

distclean: clean ## Remove everything that the set-up made
	rm -rf .venv .venv.before
