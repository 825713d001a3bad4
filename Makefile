# Chapter 17, Lesson 1, in six forms: build and run them all, then judge them.
# Each language folder brings its own rules (<folder>/port.mk) and facts (<folder>/port.toml).
# With PLANT=FILE.toml the programs are those written for it: they and all that is made of them lie in build/<name>.

# ---- Settings ----

SHELL := /bin/sh
ONLY_ASKED := $(findstring n,$(firstword -$(MAKEFLAGS)))$(findstring q,$(firstword -$(MAKEFLAGS)))
MAKEFLAGS += --no-builtin-rules --no-print-directory
unexport PYTHONDONTWRITEBYTECODE  # or every process would compile this package and its tests anew
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

PYTHON := .venv/bin/python
RUN := $(PYTHON) -B -m conformance.programs.run

ifneq ($(word 2,$(PLANT)),)
$(error PLANT: found a path with a space in it, "$(PLANT)", expected one that make can read)
endif
ifdef PLANT
NAME_IN_FILE := import re, sys, tomllib; name = tomllib.load(open(sys.argv[1], "rb"))["name"]; \
    print(*re.findall("^[A-Za-z][A-Za-z0-9_]*$$", name))
PLANT_NAME := $(or $(shell python3 -c '$(NAME_IN_FILE)' '$(PLANT)' 2>/dev/null),unnamed)
endif
STEM := $(or $(PLANT_NAME),Chapter17_Lesson1)
BUILD := build$(PLANT_NAME:%=/%)
FROM := $(PLANT_NAME:%=build/%/programs/)
WRITTEN := $(PLANT:%=$(FROM)written)
OF_PLANT := $(PLANT:%=--plant '%')
GALLERY := $(patsubst plants/%.toml,gallery/%,$(sort $(wildcard plants/*.toml)))

include $(sort $(wildcard */port.mk))

TARGETS := all bench check check-all check-gallery clean distclean environment help mutants ports readme report report-gallery system write
KEPT := badges build campaign every guests mistakes random truth unnamed variants
ifneq ($(filter $(TARGETS) $(KEPT),$(KNOWN_PORTS)),)
$(error a port cannot be called $(filter $(TARGETS) $(KEPT),$(KNOWN_PORTS)): make and the harness use that name)
endif

ifneq ($(filter-out unnamed,$(filter $(TARGETS) $(KEPT) $(KNOWN_PORTS),$(PLANT_NAME))),)
$(error a plant cannot be called $(PLANT_NAME): build/ has that name for something else)
endif

TEMPLATES := $(foreach port,$(KNOWN_PORTS),$(if $(wildcard $(FOLDER.$(port))/*.jinja),$(port)))
PORTS ?= $(KNOWN_PORTS)
UNKNOWN_PORTS := $(filter-out $(KNOWN_PORTS),$(PORTS))
ifneq ($(UNKNOWN_PORTS),)
$(error PORTS: no port is called $(UNKNOWN_PORTS); the ports are $(KNOWN_PORTS))
endif
ifneq ($(PLANT_NAME),)
override PORTS := $(filter $(TEMPLATES),$(PORTS))
endif
export PORTS

# ---- What to type ----

# One make at a time: what is typed goes on as a make below alone.sh, unless it changes nothing.
GOALS := $(or $(MAKECMDGOALS),help)
ifeq ($(or $(ALONE),$(ONLY_ASKED),$(filter help,$(GOALS))),)
.PHONY: $(GOALS)
$(firstword $(GOALS)):
	@ALONE=yes conformance/alone.sh $(MAKE) $(GOALS)
$(wordlist 2,$(words $(GOALS)),$(GOALS)): $(firstword $(GOALS))
	@:
else

.PHONY: $(TARGETS)
help:  ## this list
	@sed -n 's/^\([a-z-]*\):.*## /  make \1: /p' $(MAKEFILE_LIST) | sort
	@echo '  make PORT: one of $(KNOWN_PORTS)'
	@echo '  make all PORTS="python cpp": these alone; the same for check'
	@echo '  make all PLANT=plants/problem_1c.toml: the programs written for this plant; also check, report, mutants'

all: $(WRITTEN)  ## set up, build and run every program, and end with a table
	@status=0; $(MAKE) ports || status=$$?; \
	if [ -x $(PYTHON) ]; then $(PYTHON) -m conformance table $(OF_PLANT); fi; exit $$status

check: TESTS := -m 'not beyond'
check: $(WRITTEN)  ## bring all up to date, judge every result, and write the page
check-all: $(WRITTEN)  ## the same, with all tests: of other plants, campaigns, ports to come, the page in a browser
check check-all:
	@$(MAKE) --keep-going all || echo 'check: not every program ran; the verdict counts them' >&2
	@$(MAKE) .venv/page/installed
ifdef PLANT
	@$(PYTHON) -m conformance report $(OF_PLANT) || echo 'check: there is no page' >&2
	@$(PYTHON) -m conformance check $(OF_PLANT)
else
	$(PYTHON) -m pytest -n logical --dist loadfile --no-loadscope-reorder --junitxml=build/junit.xml $(TESTS) conformance
endif

check-gallery: environment  ## write, build, run and judge the programs of every plant in plants/ (minutes at first)
	@$(MAKE) --keep-going $(GALLERY) || echo 'check-gallery: not every program ran; the verdicts count them' >&2
	@$(PYTHON) -m conformance check --plant plants/*.toml

report: environment .venv/page/installed  ## write the page on what the programs left: build/report/index.html
	@$(PYTHON) -m conformance report $(OF_PLANT)

report-gallery: report  ## write the page of every plant; their index is build/report/plants.html
	@for plant in $(filter-out plants/Chapter17_Lesson1.toml,$(wildcard plants/*.toml)); do \
		$(PYTHON) -m conformance report --plant $$plant || exit; done

write: environment  ## bring the six programs up to date with plants/Chapter17_Lesson1.toml and the templates
	@$(PYTHON) -m conformance write plants/Chapter17_Lesson1.toml --to . --force

readme: all .venv/page/installed  ## bring the README's table and pictures up to date; the page's needs a Chromium
	@$(PYTHON) -m conformance readme

mutants: all  ## change each operator and number of every program in turn: do the checks notice? (minutes)
	$(PYTHON) -m conformance mutants $(OF_PLANT)

bench: environment .venv/bench .venv/page/installed  ## measure how long things take
	$(PYTHON) -m conformance.bench

clean:  ## remove all that was made
	rm -rf build

distclean: clean  ## remove the Python environment too
	rm -rf .venv

# ---- Set-up ----

# With --keep-going, what cannot be installed is left to the ports that need it.
system:
	@conformance/setup.sh apt.txt $(addsuffix /apt.txt,$(sort $(foreach port,$(PORTS),$(FOLDER.$(port))))) \
	$(if $(findstring k,$(firstword -$(MAKEFLAGS))),|| true)

environment: .venv/installed

.venv/installed: requirements.txt | system
	@python3 -c 'import sys; sys.exit(sys.version_info < (3, 11) and "set-up: Python 3.11 or newer is needed")'
	@echo 'set-up: installing the Python packages of requirements.txt in .venv (a minute or two)'
	@test -x $(PYTHON) || python3 -m venv .venv
	@$(PYTHON) -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.txt
	@$(PYTHON) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

.venv/bench: requirements-bench.txt | environment
	@$(PYTHON) -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements-bench.txt
	@touch $@

.venv/page/installed: requirements-page.txt conformance/pages/report/package.json conformance/pages/report/package-lock.json | environment
	@echo 'set-up: installing what the page embeds, and what tests it, in .venv (half a minute)'
	@$(PYTHON) -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements-page.txt
	@mkdir -p $(@D) && cp conformance/pages/report/package.json conformance/pages/report/package-lock.json $(@D)
	@cd -P $(@D) && ../bin/npm ci --loglevel=error --no-audit --no-fund --ignore-scripts >/dev/null
	@touch $@

# ---- Programs ----

ifdef PLANT
$(WRITTEN): $(wildcard $(dir $(PLANT))*.toml */*.jinja */port.toml conformance/programs/*.py conformance/theory/*.py) | environment
	@$(PYTHON) -m conformance write '$(PLANT)' --to $(@D) --force
	@touch $@

$(FROM)%: $(WRITTEN) ;
endif

.PHONY: $(GALLERY)
$(GALLERY): gallery/%: plants/%.toml
	@$(MAKE) ports PLANT=$<

.PHONY: $(KNOWN_PORTS)
ports: $(PORTS)
$(KNOWN_PORTS): %: $(BUILD)/%/done

$(BUILD)/%/done: conformance/programs/run.py conformance/programs/ports.py conformance/programs/sandbox.py | environment
	$(RUN) $*$(PLANT_NAME:%= %)

endif
