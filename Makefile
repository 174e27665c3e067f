# `make run` opens tfscope, `make test` passes its tests; both set everything up first.
# `make test-all` also runs the slow tests.
# Arguments for the program: make run ARGS="--volume FILE". Another build of torch:
# make clean run TORCH=torch==2.11.0 TORCH_INDEX=https://download.pytorch.org/whl/cpu

PYTHON ?= python3
TORCH ?= torch==2.13.0
TORCH_INDEX ?=
ARGS ?=

BIN := .venv/bin
# Two processes: a file's tests share what its fixtures have made.
PYTEST := QT_QPA_PLATFORM=offscreen $(BIN)/python -m pytest
TESTS := $(PYTEST) -n 2 --dist loadfile
# A window's test may fail because other work took the processors. What failed is run once more, alone.
AGAIN := --last-failed --last-failed-no-failures none
SLOW := -m "slow or hypothesis" --hypothesis-profile=fresh
INSTALL := $(BIN)/python .ci/python_packages.py

.PHONY: audit run test test-all test-slow setup lint clean

run: setup
	@$(BIN)/python main.py $(ARGS)

test: setup .venv/test-ready
	@$(TESTS) || $(PYTEST) $(AGAIN)

test-all: test test-slow

# What is slow, and property tests on cases that no run has drawn before.
test-slow: setup .venv/test-ready
	@$(TESTS) $(SLOW) || $(PYTEST) $(SLOW) $(AGAIN)

setup: .venv/ready
	@$(BIN)/python .ci/system_libraries.py

lint: setup .venv/lint-ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# Known vulnerabilities of what is installed; the one target that asks the network for anything but packages.
audit: setup
	$(PYTHON) -m venv .venv/audit
	.venv/audit/bin/python -m pip install --quiet pip-audit
	.venv/audit/bin/pip-audit --path $$($(BIN)/python -c "import sysconfig; print(sysconfig.get_path('purelib'))")

clean:
	rm -rf .venv

# torch is pinned, and from an index of its own where TORCH_INDEX names one.
.venv/ready: pyproject.toml
	@$(PYTHON) .ci/system_libraries.py --python
	$(PYTHON) -m venv .venv
	$(if $(TORCH_INDEX),$(INSTALL) --index-url $(TORCH_INDEX) "$(TORCH)")
	$(INSTALL) "$(TORCH)" --editable .
	@touch $@

.venv/test-ready: .venv/ready
	$(INSTALL) --editable ".[test]"
	@touch $@

.venv/lint-ready: .venv/ready
	$(INSTALL) --editable ".[test,dev]"
	@touch $@
