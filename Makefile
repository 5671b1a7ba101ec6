# `make run` opens the window; `make test` checks everything. Both install what is missing first.

# Cargo profile of `make run`. Tests use `dev`, which is optimised too.
PROFILE ?= release
# What `make run` passes on, for example `make run ARGS="train photos --out scene"`.
ARGS ?=

.PHONY: run test bars setup demo-asset

run:
	@PROFILE='$(PROFILE)' tools/run.sh $(ARGS)

test:
	@tools/test.sh

# Objects and parts in unseen views, compared with docs/results/bars.csv.
bars:
	@PROFILE=release tools/run.sh --version
	@tools/bars.py

# The trained demo that ships with the program (docs/guide.md).
demo-asset:
	@PROFILE='$(PROFILE)' tools/run.sh demo --make assets/demo/demo.zip --out out/demo-asset

# System packages and the Rust tools only; `run` and `test` do this by themselves.
setup:
	@tools/setup.sh test
