# `make` alone lists the targets. Every target runs set-up first.

SCENARIO ?= paper
CONTROLLER ?= team
PYTHON_IN_VENV := .venv/bin/python

.NOTPARALLEL: # `make lint test` runs in this order, with any -j

.PHONY: help
help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-16s%s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.PHONY: setup
setup: ## make the Python environment and build the workspace; later only what changed (PYTHON=python3.12)
	@setup/setup.sh

.PHONY: demo
demo: setup ## fly the paper's scenario (SEED=7, SCENARIO=name or file, CONTROLLER=retuned, ARGS="--no-record")
	@$(PYTHON_IN_VENV) scripts/fly.py --scenario $(SCENARIO) --set controller=$(CONTROLLER) $(if $(SEED),--seed $(SEED)) $(ARGS)

.PHONY: live
live: setup ## fly by hand in a browser, from the ground (PORT=8090, and what make demo takes)
	@$(PYTHON_IN_VENV) scripts/live.py $(if $(PORT),--port $(PORT)) --fly \
		--scenario $(SCENARIO) --set controller=$(CONTROLLER) --idle $(if $(SEED),--seed $(SEED)) $(ARGS)

.PHONY: test
test: setup ## run all tests, those with ROS two at a time (some: ARGS="tests/unit -k yaw")
ifdef ARGS
	@$(PYTHON_IN_VENV) -m pytest $(ARGS)
else
	@$(PYTHON_IN_VENV) -m pytest -n auto --dist loadfile --ignore tests/ros --ignore tests/browser
	@$(PYTHON_IN_VENV) -m pytest -n 2 --dist loadfile --reruns 1 tests/ros tests/browser
endif

.PHONY: test-pythons
test-pythons: ## run the tests with each supported Python of this machine, in clones (some: ARGS="tests/unit")
	@setup/test_pythons.sh $(ARGS)

.PHONY: coverage
coverage: setup ## measure which branches the tests without ROS take, at least 90% of all that is not ROS
	@$(PYTHON_IN_VENV) -m pytest -n auto --dist loadfile --ignore tests/ros --ignore tests/browser --cov --cov-report term:skip-covered $(ARGS)

.PHONY: mutation
mutation: setup ## change the code a little, and see whether the tests notice (about an hour)
	@$(PYTHON_IN_VENV) setup/mutation.py $(ARGS)

.PHONY: paper
paper: setup ## fly the paper's evaluation into runs/paper-evaluation; continues after a stop (ARGS="--jobs 1")
	@$(PYTHON_IN_VENV) scripts/paper.py $(ARGS)

.PHONY: accuracy
accuracy: setup ## fly the accuracy table into runs/accuracy, raw beside team; continues after a stop (ARGS="--seeds 10")
	@$(PYTHON_IN_VENV) scripts/accuracy.py $(ARGS)

.PHONY: bench
bench: setup ## measure the solver beside acados (ARGS="--vehicles 3 8"), and control steps without ROS
	@$(PYTHON_IN_VENV) scripts/bench_solver.py $(ARGS)
	@$(PYTHON_IN_VENV) scripts/bench.py

.PHONY: bench-ros
bench-ros: setup ## measure the CPU time of a control step over ROS, process by process
	@$(PYTHON_IN_VENV) scripts/bench_ros.py $(ARGS)

.PHONY: bench-real-time
bench-real-time: setup ## measure latency and missed deadlines of flights on the wall clock
	@$(PYTHON_IN_VENV) scripts/bench_real_time.py $(ARGS)

.PHONY: faults
faults: setup ## fly the fault campaign into runs/faults, 200 cases (ARGS="--cases 25")
	@$(PYTHON_IN_VENV) scripts/faults.py $(ARGS)

.PHONY: lint
lint: setup ## check style, types and import rules
	@$(PYTHON_IN_VENV) -m ruff check
	@$(PYTHON_IN_VENV) -m ruff format --check
	@$(PYTHON_IN_VENV) -m mypy
	@.venv/bin/lint-imports --no-logo

.PHONY: format
format: setup ## format the sources
	@$(PYTHON_IN_VENV) -m ruff check --fix
	@$(PYTHON_IN_VENV) -m ruff format

.PHONY: lock
lock: setup ## pin new entries of requirements*.in (ARGS=--upgrade: pin everything to the newest version)
	@setup/lock.sh $(ARGS)

.PHONY: clean
clean: ## remove everything that was built; recorded runs stay
	rm -rf .venv build install log .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find config scripts setup src tests -name __pycache__ -prune -exec rm -rf {} +
