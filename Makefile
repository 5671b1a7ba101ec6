# `make run` opens the window; `make test` checks everything. Both install what is missing first.

# Cargo profile of `make run`. Tests use `dev`, which is optimised too.
PROFILE ?= release
# What `make run` passes on, for example `make run ARGS="train photos --out scene"`.
ARGS ?=

.PHONY: run test setup

run:
	@PROFILE='$(PROFILE)' tools/run.sh $(ARGS)

test:
	@tools/test.sh

# System packages and the Rust tools only; `run` and `test` do this by themselves.
setup:
	@tools/setup.sh test
