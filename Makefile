# `make` alone says what there is. Every target sets up what it needs first.

SCENARIO ?= config/scenarios/paper.yaml
PYTHON_IN_VENV := .venv/bin/python

.NOTPARALLEL: # `make lint test` in that order, whatever -j says

.PHONY: help
help: ## what can be made
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-8s%s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.PHONY: setup
setup: ## the Python environment and the built workspace; done once, then only what changed (PYTHON=python3.12)
	@setup/setup.sh

.PHONY: demo
demo: setup ## fly the paper's scenario (SEED=7, SCENARIO=config/scenarios/..., ARGS="--no-record")
	@$(PYTHON_IN_VENV) scripts/fly.py --scenario $(SCENARIO) $(if $(SEED),--seed $(SEED)) $(ARGS)

.PHONY: test
test: setup ## all tests (ARGS="tests/unit -k yaw" for some)
	@$(PYTHON_IN_VENV) -m pytest $(ARGS)

.PHONY: paper
paper: setup ## the paper's evaluation flown again, into runs/paper-evaluation (ARGS="--jobs 1"); goes on where it was stopped
	@$(PYTHON_IN_VENV) scripts/paper.py $(ARGS)

.PHONY: bench
bench: setup ## speed of the solver and of flights without ROS
	@$(PYTHON_IN_VENV) scripts/bench.py $(ARGS)

.PHONY: lint
lint: setup ## style, types and import rules
	@$(PYTHON_IN_VENV) -m ruff check
	@$(PYTHON_IN_VENV) -m ruff format --check
	@$(PYTHON_IN_VENV) -m mypy
	@.venv/bin/lint-imports --no-logo

.PHONY: format
format: setup ## put the sources into shape
	@$(PYTHON_IN_VENV) -m ruff check --fix
	@$(PYTHON_IN_VENV) -m ruff format

.PHONY: lock
lock: setup ## pin what is new in requirements*.in (ARGS=--upgrade: everything, to the newest)
	@setup/lock.sh $(ARGS)

.PHONY: clean
clean: ## remove all that was built; recorded runs stay
	rm -rf .venv build install log .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find config scripts setup src tests -name __pycache__ -prune -exec rm -rf {} +
