# `make demo` and `make test` do all set-up on a machine with Python and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
VALIDATOR := $(VENV)/node_modules/gltf-validator/package.json
AUDIT := $(VENV)/audit/bin/python
SITE := $(VENV)/site/bin/zensical
COVERAGE := $(VENV)/.installed-coverage
GENERATORS := $(VENV)/generators/.installed
CHART := $(VENV)/chart/.installed
STAMP := $(VENV)/.installed
TOOLS := $(VENV)/.installed-tests
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
SUDO := $(if $(filter 0,$(shell id -u)),,sudo)

.PHONY: demo test check unit fuzz openapi references audit validator generators chart browser screenshots site wheel wheels coverage clean

demo: $(STAMP)
	$(BIN)/meshcone demo

# The tests that start brokers, workers and browsers wait for them most of their time: two files
# at once, whatever the number of processors. Tests of one file share what they start; the longest
# files come first, as tests/conftest.py orders them. The tests of the API's contract go by one name,
# by which they cannot be shared out.
CONTRACT := tests/acceptance/test_contract.py
test: check unit
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder tests/integration tests/acceptance --ignore=$(CONTRACT)
	$(BIN)/python -m pytest $(CONTRACT)

check: $(TOOLS)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/meshcone openapi --check

unit: $(TOOLS)
	$(BIN)/python -m pytest -n logical tests/unit

# Damages files at random for minutes: fifty times what the suite tries.
fuzz: $(TOOLS)
	$(BIN)/python -m pytest -n logical tests/unit/assets/test_fuzz.py --hypothesis-profile=fuzz -o timeout=1800

openapi: $(STAMP)
	$(BIN)/meshcone openapi

# The tables in docs/ that the code makes.
references: $(TOOLS)
	$(BIN)/python -m tests.references

# Known vulnerabilities of the pinned versions; its tool has an environment of its own, so that
# nothing of it is among what it looks at.
audit: $(AUDIT)
	$(AUDIT) .ci/audit

$(AUDIT): $(STAMP)
	$(PYTHON) -m venv $(VENV)/audit
	-$(AUDIT) -m pip install --quiet --disable-pip-version-check pip-audit==2.10.1

# The documentation as a site, which the pages serve under /help from then on, and which goes into
# the next wheel; a broken link ends it. Its tool has an environment of its own.
site: $(SITE)
	$(SITE) build --clean --strict

$(SITE):
	$(PYTHON) -m venv $(VENV)/site
	$(VENV)/site/bin/python -m pip install --quiet --disable-pip-version-check zensical==0.0.73

# Branch coverage of all tests, in the processes they start too. It takes twice the time of the tests.
coverage: $(COVERAGE)
	rm -rf .coverage
	mkdir .coverage
	$(BIN)/coverage run -m pytest -n 2 --dist loadfile --no-loadscope-reorder tests --ignore=$(CONTRACT)
	$(BIN)/coverage run -m pytest $(CONTRACT)
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report --include 'meshcone/*' --skip-covered --fail-under 95
	$(BIN)/coverage report --include 'worker/*' --skip-covered --fail-under 90
	$(BIN)/coverage report --include 'service/*' --skip-covered --fail-under 90

$(COVERAGE): $(TOOLS)
	$(INSTALL) coverage==7.17.5
	touch $@

# What is published, in dist: sdist, wheel and bill of materials. The wheel is installed into an empty
# environment and tried there by the demo.
wheel: site
	$(PYTHON) .ci/wheel $(PYTHON)

# The same with every Python it is said to work with, as far as they are on this machine.
wheels: site
	$(PYTHON) .ci/wheel python3.11 python3.12 python3.13 python3.14

# Khronos' glTF validator, which some tests ask; without it, and outside CI, they are skipped.
validator: $(VALIDATOR)

$(VALIDATOR): $(STAMP)
	npm install --no-save --no-package-lock --no-audit --no-fund --prefix $(VENV) gltf-validator@2.0.0-dev.3.10

# Tools of others that make clients of the API's description; they need older versions of what we
# need, so they have an environment of their own. Without them, and outside CI, those tests are skipped.
# Helm, as its SDK, and the schemas of Kubernetes: what tests hold the chart against.
chart: $(CHART)

$(CHART): $(STAMP)
	$(PYTHON) -m venv $(VENV)/chart
	$(VENV)/chart/bin/python -m pip install --quiet --disable-pip-version-check \
		helm-python-sdk==0.2.2 kubernetes-validate==1.37.0
	touch $@

generators: $(GENERATORS)

$(GENERATORS): $(STAMP)
	$(PYTHON) -m venv $(VENV)/generators
	$(VENV)/generators/bin/python -m pip install --quiet --disable-pip-version-check openapi-python-client==0.29.1
	npm install --no-save --no-package-lock --no-audit --no-fund --prefix $(VENV)/generators \
	  openapi-typescript@7.13.0 openapi-fetch@0.17.0 typescript@5.9.3 @types/node@20.19.43
	touch $@

# Debian's Chromium, in which the pages are tested, and curl, whose command they show; without
# them, and outside CI, those tests are skipped.
browser:
	command -v chromium >/dev/null && command -v curl >/dev/null || { \
	  $(SUDO) apt-get update -qq && \
	  $(SUDO) apt-get install -qq -y --no-install-recommends chromium curl fonts-dejavu-core; }

# The pictures of the pages in docs/, made by the tests that look at them.
screenshots: $(TOOLS) browser
	MESHCONE_SCREENSHOTS=docs/images/dashboard $(BIN)/python -m pytest tests/acceptance/dashboard

$(VENV)/bin/python:
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "MeshCone needs Python 3.11 or newer; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)

# What the program needs, and nothing of what its tests need.
$(STAMP): pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "Installing MeshCone into $(VENV): about 900 MB, a minute or two"
	$(INSTALL) --editable .
	$(BIN)/python -c "import meshcone.verbs.refine, meshcone.surface.box_tree" # compiled now, not at the first use
	touch $@

$(TOOLS): $(STAMP)
	@echo "Installing the tests' tools into $(VENV): about 1,400 MB more, some minutes"
	$(INSTALL) --editable '.[test]'
	touch $@

clean:
	rm -rf $(VENV) build dist *.egg-info service/dashboard/site .pytest_cache .coverage .mypy_cache .ruff_cache .hypothesis
