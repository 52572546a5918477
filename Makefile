# On a fresh machine with Python 3.11 or newer, git and make, each target alone sets up what it needs.

PYTHON ?= python3
PY := .venv/bin/python
ARGS ?=

# What another environment of the user's would otherwise slip into this one.
unexport PYTHONPATH PYTHONHOME PYTHONSAFEPATH VIRTUAL_ENV PIP_USER PIP_TARGET PIP_PREFIX

# One thread each: the problems are small, and the answers shall not depend on the number of cores.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export NUMEXPR_NUM_THREADS := 1
export VECLIB_MAXIMUM_THREADS := 1
export MPLBACKEND := Agg

.PHONY: help demo test serve check check-slow bench campaign docs gallery constraints clean
.DEFAULT_GOAL := help

help:  ## say what there is
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1|\2/p' Makefile | awk -F'|' '{printf "%-20s %s\n", $$1, $$2}'

demo: .venv/.kernels  ## start the service, plan a pick and place with every method, draw build/demo.png
	$(PY) examples/demo.py

test: .venv/.kernels  ## run the tests (pick some with ARGS="-k word")
	$(PY) -m pytest -m "not slow" $(ARGS)

serve: .venv/.installed  ## run the service on http://127.0.0.1:8000 (other settings with ARGS="--port 9000")
	$(PY) -m api serve $(ARGS)

check: .venv/.kernels  ## what a change must pass: lint, format, types, tests
	$(PY) -m ruff check
	$(PY) -m ruff format --check
	$(PY) -m mypy
	WAYWRIGHT_EXAMPLES=10 $(PY) -m pytest -m "not slow"

check-slow: .venv/.kernels  ## the slow tests, and the packages installed in clean environments
	$(PY) -m pytest -m slow
	.ci/packages $(PY)

bench: .venv/.bench  ## compare with peers: build/bench/report.md (a fast look with ARGS=--quick)
	$(PY) -m benchmarks $(ARGS)

campaign: .venv/.installed  ## attack a running service, for hours: build/campaign/report.md (minutes with ARGS="--size ci")
	$(PY) -m benchmarks.campaign $(ARGS)

docs: .venv/.installed  ## rewrite the pages that are made from the code
	$(PY) -c 'from planner.catalogue import markdown; open("docs/methods.md", "w", encoding="utf-8").write(markdown())'

gallery: .venv/.installed  ## draw the gallery's pictures and rewrite docs/gallery.md
	$(PY) examples/gallery.py

constraints:  ## take the newest versions that pyproject.toml allows into constraints.txt
	rm -rf build/constraints
	$(PYTHON) -m venv build/constraints
	build/constraints/bin/python -m pip install --upgrade pip setuptools '.[all,dev,bench]'
	echo '# Exact versions of everything that .[all,dev,bench] installs. Made by: make constraints' > constraints.txt
	build/constraints/bin/python -m pip freeze --all --exclude pip --exclude waywright >> constraints.txt

clean:  ## remove the environment and everything built
	rm -rf .venv build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis

# The stamp holds this folder's path: in a folder that was moved, or whose Python is gone, it does not count.
ifneq ($(shell test -x $(PY) && cat .venv/.installed 2>/dev/null),$(CURDIR))
.PHONY: .venv/.installed
endif

# Always from nothing, so that an installation that was interrupted half way leaves no trace.
.venv/.kernels: .venv/.installed $(wildcard planner/kernels/*.py)
	@echo 'Compiling the kernels: once, for two or three minutes.'
	$(PY) -c 'from api.engine.warm import warm; warm()'
	touch $@

.venv/.installed: pyproject.toml constraints.txt
	@command -v "$(PYTHON)" >/dev/null || { echo "make: there is no $(PYTHON); name a Python 3.11 or newer with PYTHON=..."; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
		echo "make: $(PYTHON) is older than Python 3.11; name a newer one with PYTHON=..."; exit 1; }
	@"$(PYTHON)" -c 'import venv, ensurepip' 2>/dev/null || { \
		echo "make: $(PYTHON) has no venv module (on Debian and Ubuntu: apt-get install python3-venv)"; exit 1; }
	@echo "Setting up .venv; the first time this takes a minute or two."
	"$(PYTHON)" -m venv --clear .venv
	$(PY) -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[all,dev]'
	@echo '$(CURDIR)' > $@

.venv/.bench: .venv/.installed
	$(PY) -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[bench]'
	@touch $@
