# A fresh clone needs Python >= 3.11, make and the network; these do the rest.
#   make run          drive KBot in the browser          (ARGS="--no-browser --port 9000")
#   make test         checks and all tests               (ARGS="-k xacro" for some of the Python tests)
#   make check        lint, format, types and layers, of Python and of the page
#   make test-peers   tests against real programs: ROS 1 and 2, libsdformat, pip, pre-commit (Debian, Ubuntu)
#   make audit        known weaknesses of the Python and npm packages that KBot uses
#   make docs         the documentation site, in build/docs; a broken link is an error
#   make benchmarks   what it costs, as ratios
#   make clean        forget what was set up

# The stamps carry the place: a clone that was moved is set up anew.
place := $(shell pwd -P | cksum | cut -d' ' -f1)
python := .venv/bin/python
venv := .venv/made-$(place)
installed := .venv/installed-$(place)
tests := .venv/tests-$(place)
# pip would compile 36 MB of bytecode, of which a simulation imports 6 MB. Python compiles these when it imports them.
pip := $(python) -m pip install -q --no-compile --disable-pip-version-check
npm := $(python) hatch_build.py npm --silent
page := $(shell find web -type f -not -path '*/node_modules/*' -not -path 'web/tests/*' 2>/dev/null)

.PHONY: run test check test-page test-peers audit docs benchmarks clean
.DELETE_ON_ERROR:

run: $(installed)
	@$(python) -m kbot $(ARGS)

test: check test-page
	@sh scripts/need_chromium.sh
	$(python) -m pytest --ignore=tests/peers $(ARGS)

check: $(tests)
	$(python) -m ruff check
	$(python) -m ruff format --check
	$(python) -m mypy
	.venv/bin/lint-imports
	@$(npm) run check

test-page: $(tests)
	@$(npm) test

test-peers: $(tests)
	@sh scripts/need_ros1.sh
	@sh scripts/need_sdformat.sh
	$(python) -m pytest -n 0 tests/peers $(ARGS)

# The extra `test` includes all others but `bench`.
audit: $(tests)
	@$(pip) --upgrade pip pip-audit -e ".[bench]"
	$(python) -m pip_audit --skip-editable
	$(python) hatch_build.py npm audit

docs: $(tests)
	@$(python) docs/build.py build/docs

benchmarks: $(tests)
	$(python) benchmarks/run.py $(ARGS)

clean:
	rm -rf .venv build dist web/node_modules src/kbot/workbench/page

$(venv):
	@sh scripts/make_venv.sh
	@touch $@

$(installed): $(venv) pyproject.toml $(wildcard hatch_build.py) $(page)
	@echo "Installing KBot into .venv (the first time takes a minute or two)"
	@$(pip) -e .
	@touch $@

$(tests): $(installed)
	@sh scripts/need_wheels.sh test $(python)
	@echo "Installing what the tests need into .venv"
	@$(pip) -e ".[test]"
	@touch $@
