# Each target makes what it needs: a virtual environment in .venv with the versions of constraints.txt.
#   make fit                                 train NEP-HEAT with the paper's setting
#   make fit ARGS="--trainer.max_epochs 2"   the same, with options passed on
#   make any-home                            train and play the network for homes of any kind: results/any_home.md
#   make any-home SEEDS="0 1 2"              the same, trained three times
#   make reproduce                           train and play what the paper's tables need; goes on where it stopped
#   make test | make quick                   all tests | those that are not slow
#   make check | make bench                  ruff and mypy | benchmarks
#   make fuzz                                changed files, odd calls and options, kills, threads, forged requests (minutes)
#   make ros-test                            the node of ros/ under ROS 2, which is installed and built (minutes at first)
#   make docs                                the site: guides, API, commands, results; then open site/index.html
#   make dist                                sdists and wheels of `sgm` and of the rest, into dist/
#   make fit PYTHON=/path/to/python3.13      choose the Python that .venv is made from

VENV := .venv
PY := $(VENV)/bin/python
STAMP := $(VENV)/.installed
EXTRAS := $(VENV)/.extras
ARGS ?=
SEEDS ?= 0
# Where a shell says so, Python keeps nothing of what it compiles, and each command starts a second later.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help install fit any-home reproduce test quick check bench fuzz docs dist core-test research-test newest-test ros-test clean

help:
	@sed -n 's/^# \{0,1\}//p' Makefile | head -n 13

install: $(STAMP)

fit: $(STAMP)
	$(PY) -m nep.fit --config heat.yaml $(ARGS)

# Trains from nothing, under half an hour a seed on 2 cores; RECORDED="folder ..." adds recorded homes to the table.
any-home: $(STAMP)
	@set -e; for seed in $(SEEDS); do \
	  fit="$(PY) -m nep.fit --config any_home.yaml --seed_everything $$seed --trainer.logger.init_args.version"; \
	  looks=runs/any_home/first_$$seed/checkpoints/last.ckpt; \
	  $$fit first_$$seed --trainer.max_epochs 1 $(ARGS); \
	  $$fit second_$$seed --data.also_policies "[nep.players.policy:NEPPolicy=$$looks]" $(ARGS); \
	  $(PY) -m nep.export runs/any_home/second_$$seed/checkpoints/last.ckpt runs/any_home/seed_$$seed \
	    --num_homes 100 --steps 100; \
	done
	$(PY) -m tools.bench any_home --out results/any_home.md $(if $(RECORDED),--recorded $(RECORDED)) \
	  --checkpoint any_home=runs/any_home/seed_$(firstword $(SEEDS)) \
	  $(foreach seed,$(wordlist 2,99,$(SEEDS)),seed_$(seed)=runs/any_home/seed_$(seed)) heat

reproduce: $(STAMP)
	$(PY) -m nep.reproduce --table all --out results $(ARGS)

# Two processes; all tests of a file go to one of them, as they share what it makes ready. Files in
# their own order: by number of tests, the longest tests, which are alone in their files, would be last.
PYTEST := $(PY) -m pytest -n 2 --dist loadfile --no-loadscope-reorder

test: $(EXTRAS)
	$(PYTEST) $(ARGS)

quick: $(EXTRAS)
	$(PYTEST) -m "not slow" $(ARGS)

check: $(EXTRAS)
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy

bench: $(EXTRAS)
	$(PY) benchmarks $(ARGS)

fuzz: $(EXTRAS)
	$(PY) tests/fuzz $(ARGS)

docs: $(EXTRAS)
	NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --strict $(ARGS)
	@echo "built site/index.html"

# Each wheel is built from its sdist, in a folder without the repository.
dist: $(STAMP)
	@rm -rf dist build core/build  # setuptools takes along what was built before
	$(PY) -m build --no-isolation --quiet --outdir dist ./core
	$(PY) -m build --no-isolation --quiet --outdir dist .

# Wheels in fresh environments: `sgm` and simulated homes without torch on the newest Python, both on that of .venv, and
# a fast share of the tests on the newest Python, where torch comes without CUDA.
core-test: dist
	$(PY) tests/wheels.py core $(ARGS)

research-test: dist
	$(PY) tests/wheels.py research $(ARGS)

newest-test: dist
	$(PY) tests/wheels.py newest $(ARGS)

# In .ros: a Python 3.12 with ROS 2 Jazzy, and a colcon workspace; .venv is not needed. -S: a package that is
# installed and is called `tests`, too, would be taken first.
ros-test:
	$(if $(PYTHON),'$(PYTHON)',python3) -S -m tests.ros.workspace $(ARGS)

clean:
	rm -rf $(VENV) .ros build dist core/build *.egg-info core/*.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis

# Python 3.11 first: dgl has no wheels beyond it. Every folder of PATH is tried, not only the first hit: version
# managers put commands there that answer "not installed".
NAMES := python3.11 python3.10 python3.13 python3.12 python3.14 python3 python
SUPPORTED := import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 10))
# A Python that is named and is not of the version of .venv: then .venv is made anew.
VERSION := import sys; print(sys.version_info[:2])
OTHER := $(if $(PYTHON),$(shell [ "$$('$(PYTHON)' -c '$(VERSION)' 2>&1)" = "$$($(PY) -c '$(VERSION)' 2>/dev/null)" ] || echo OTHER))
.PHONY: OTHER

$(STAMP): setup.cfg core/setup.cfg pyproject.toml constraints.txt $(OTHER)
	@set -e; \
	if [ -n "$(OTHER)" ] || ! $(PY) -c '$(SUPPORTED)' 2>/dev/null; then \
	  python=; \
	  IFS=:; \
	  for name in $(if $(PYTHON),'$(PYTHON)',$(NAMES)); do \
	    for folder in $(if $(PYTHON),'',$$PATH); do \
	      candidate="$${folder:+$$folder/}$$name"; \
	      if [ -z "$$python" ] && "$$candidate" -c '$(SUPPORTED)' 2>/dev/null; then python="$$candidate"; fi; \
	    done; \
	  done; \
	  unset IFS; \
	  if [ -z "$$python" ]; then \
	    echo "Python must be 3.10 or newer with its venv module, got none $(if $(PYTHON),at $(PYTHON),on PATH)." \
	      "Install one (on Debian and Ubuntu: python3.11 and python3.11-venv), or name one:" \
	      "make PYTHON=/path/to/python3.11" >&2; \
	    exit 1; \
	  fi; \
	  echo "Creating $(VENV) with $$python"; \
	  "$$python" -m venv --clear $(VENV); \
	  $(PY) -c 'import sys; sys.exit(sys.version_info < (3, 12))' 2>/dev/null && \
	    echo "DGL has no wheels beyond Python 3.11: our encoders run on a stand-in; batch.graph and encoders that import dgl are not there" || true; \
	fi
	@echo "Step 1 of 2: installing the packages of constraints.txt into $(VENV): 2.8 GB on disk, of which torch has 0.7"
	@$(PY) tools/install.py --constraint constraints.txt --editable ./core --editable '.[dev,igridson,priors]'
	@echo "Step 2 of 2: compiling the inner loops of the simulator, once: a minute or two"
	@$(PY) -m simulator.compile
	@touch $@

# What tests and benchmarks use besides: every extra that has wheels.
$(EXTRAS): $(STAMP)
	@echo "Installing all extras for the tests: Ray, Stable-Baselines3, spark_dsg, ..."
	@$(PY) tools/install.py --constraint constraints.txt --editable ./core --editable '.[dev,all]'
	@touch $@
