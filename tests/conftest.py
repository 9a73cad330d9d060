"""The command line, called in the test's own process."""

import sys

import pytest

from mpad_core import cli


@pytest.fixture
def mpad(monkeypatch, capsys):
    """Call the command line in this process; whatever escapes it, but its exit, fails the test."""

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["mpad", *map(str, words)])
        capsys.readouterr()
        code = 0
        try:
            cli.main()
        except SystemExit as leaving:
            code = leaving.code or 0
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return code, out, err

    return call
