# leafcut: `make demo` runs the main job, `make test` runs the tests; each sets up all it needs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
READY_DEV := $(VENV)/.ready-dev
READY_DOCS := $(VENV)/.ready-docs

#: Environments of their own: the lowest versions that are allowed, and no extra, which each Python has once.
LOWEST := .venv-lowest
CORE := .venv-core-$(notdir $(PYTHON))
#: Tests of what depends most on other packages, and that need no extra; with the packages of tomorrow and yesterday
#: what only warns of its end may warn.
SMOKE := tests/test_extras.py tests/test_files.py tests/geometry/test_curves.py tests/geometry/test_index.py \
    tests/read/test_read_dxf.py tests/read/test_read_excellon.py tests/read/test_read_picture.py \
    tests/read/test_read_pockets.py tests/kernels/test_keeping.py tests/processes/sheet/plan/test_clear_pierces.py \
    tests/processes/pocket/plan/test_pocket_region.py
#: What the studio stands on besides: its forms, its programs' interface, its jobs and its door.
STUDIO := $(addprefix tests/studio/test_studio_,api.py forms.py jobs.py library.py safety.py)
SMOKE_FLAGS := -n 2 --dist worksteal -p no:cacheprovider -o filterwarnings= --disable-warnings

.PHONY: demo test test-lowest test-core check coverage docs wheels wheel-check format clean

demo: $(READY)
	@mkdir -p demo
	$(BIN)/leafcut optimize examples/plate_70.dxf -o demo/plate_70.ngc --report demo/plate_70.html \
	    --machine linuxcnc-mill --thickness 0.25in

test: $(READY_DEV)
	$(BIN)/pytest -n 2 --dist worksteal

test-lowest: $(LOWEST)/.ready
	$(LOWEST)/bin/pytest $(SMOKE_FLAGS) $(SMOKE) $(STUDIO) tests/processes/nesting/plan/test_nest_blocks.py

test-core: $(CORE)/.ready
	$(CORE)/bin/leafcut optimize examples/plate_27.dxf --thickness 6
	$(CORE)/bin/pytest $(SMOKE_FLAGS) $(SMOKE)

check: $(READY_DEV)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/pytest -q tests/test_imports.py

# Like `test`, and tells which lines no test has run (htmlcov/index.html).
coverage: $(READY_DEV)
	$(BIN)/pytest -n 2 --dist worksteal --cov --cov-report=term:skip-covered --cov-report=html

docs: $(READY_DOCS)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet

# Two wheels in dist: one for every machine, and one with machine code for machines as this one.
wheels:
	$(PYTHON) .ci/build_wheels.py

# The wheels in an environment of their own, without extras: their commands work without the checkout.
wheel-check:
	$(PYTHON) .ci/check_wheel.py

format: $(READY_DEV)
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

clean:
	rm -rf $(VENV) $(VENV)-lowest $(VENV)-core-* demo site htmlcov .coverage .pytest_cache .mypy_cache .ruff_cache .hypothesis

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

$(LOWEST)/.ready: pyproject.toml .ci/lowest_versions.py
	$(PYTHON) -m venv $(LOWEST)
	$(LOWEST)/bin/python .ci/lowest_versions.py > $(LOWEST)/constraints.txt
	$(LOWEST)/bin/python -m pip install --quiet --disable-pip-version-check -c $(LOWEST)/constraints.txt \
	    -e '.[all]' pytest pytest-xdist hypothesis 'httpx2>=2'
	@touch $@

$(CORE)/.ready: pyproject.toml
	$(PYTHON) -m venv $(CORE)
	$(CORE)/bin/python -m pip install --quiet --disable-pip-version-check -e . pytest pytest-xdist hypothesis
	@touch $@
