"""Tests of the Python package; they need the program (`FMLGS_BINARY`, or in `PATH`)."""
