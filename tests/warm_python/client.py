"""Stands for the interpreter: `client.py ADDRESS PYTHON`, and then the arguments of `python`.

The server at ADDRESS forks a process with the files, folder and environment of this one; signals
are passed on, and this process ends as that one ends. With other options than `-m` and `-c`, or
where no server listens, it becomes PYTHON.
"""

import _socket  # half of the time that socket takes
import array
import fcntl
import json
import os
import signal
import sys

SIGNALS = (signal.SIGHUP, signal.SIGINT, signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2)


def main():
    address, python, *arguments = sys.argv[1:]
    if arguments[:1] == ["-B"]:  # multiprocessing passes it on, and the server has it as well
        del arguments[0]
    files = array.array("i", list_inherited_files())
    connection = _socket.socket(_socket.AF_UNIX, _socket.SOCK_STREAM)
    try:
        if not arguments or (arguments[0][0] == "-" and arguments[0] not in ("-m", "-c")):
            raise OSError("an option for the interpreter itself")
        connection.connect(address)
    except OSError:
        os.execv(python, [python, *arguments])
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda number, _: connection.send(bytes([number])))
    request = {
        "arguments": arguments,
        "folder": os.getcwd(),
        "environment": dict(os.environ),
        "files": list(files),
    }
    body = json.dumps(request).encode()
    rights = (_socket.SOL_SOCKET, _socket.SCM_RIGHTS, files)
    connection.sendmsg([len(body).to_bytes(8, "big")], [rights])
    connection.sendall(body)
    status = connection.recv(4)
    if len(status) < 4:
        sys.exit("The server of tests/warm_python must answer, got nothing. See its log.")
    code = int.from_bytes(status, "big", signed=True)
    if code < 0:
        if -code in SIGNALS:
            signal.signal(-code, signal.SIG_DFL)
        os.kill(os.getpid(), -code)
    os._exit(code)


def list_inherited_files():
    """Return the numbers of open files that came with the process."""
    found = []
    for name in os.listdir("/proc/self/fd"):
        try:
            if not fcntl.fcntl(int(name), fcntl.F_GETFD) & fcntl.FD_CLOEXEC:
                found.append(int(name))
        except OSError:  # the folder itself, which is closed again
            pass
    return found


main()
