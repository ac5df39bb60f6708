"""What `make install` calls: uv with the indexes that pip is set up with."""

import sys

from tools.install import find_settings, main, make_command

LISTED = """:env:.cert='/etc/certs.crt'
:env:.default-timeout='180'
global.extra-index-url='https://one/simple\\nhttps://two/simple'
global.find-links='/wheels /more'
user.index-url='https://mirror/simple'
"""


def test_uv_is_given_the_indexes_of_pip():
    settings = find_settings(LISTED)
    assert settings == {
        "SSL_CERT_FILE": "/etc/certs.crt",
        "UV_INDEX": "https://one/simple https://two/simple",
        "UV_FIND_LINKS": "/wheels,/more",
        "UV_DEFAULT_INDEX": "https://mirror/simple",
    }
    command = make_command(["torch"], settings)
    assert command[-1] == "torch"
    assert "unsafe-best-match" in command
    assert "--torch-backend" not in command


def test_without_own_indexes_torch_comes_without_cuda():
    for listed in ("", "global.timeout='5'", ":env:.cert='/etc/certs.crt'"):
        command = make_command(["torch"], find_settings(listed))
        assert command[command.index("--torch-backend") + 1] == "cpu"
        assert command[command.index("--python") + 1] == sys.executable


def test_pip_takes_over_where_uv_fails(monkeypatch, capfd):
    """With what uv says before, and the status of pip."""
    calls = []

    class Done:
        def __init__(self, returncode):
            self.returncode, self.stdout = returncode, ""

    def run(command, **_):
        calls.append(command)
        return Done(1 if "uv" in command[1:] and "install" in command and "pip" in command else 0)

    monkeypatch.setattr("tools.install.subprocess.run", run)
    monkeypatch.setattr("tools.install.importlib.util.find_spec", lambda name: object())
    assert main(["--constraint", "constraints.txt", "numpy"]) == 0
    assert calls[-1][1:3] == ["-m", "pip"]
    assert calls[-1][-3:] == ["--constraint", "constraints.txt", "numpy"]
    assert "--quiet" not in calls[-1]
    assert "pip tries it now" in capfd.readouterr().out
