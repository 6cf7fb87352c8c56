"""What the benches in Python have in common."""

import os
import subprocess
import sys


def used_by(command):
    """What a command used (resource.getrusage); ends the bench if it fails. Prints nothing of the command's."""
    words = [str(word) for word in command]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{sys.argv[0]}: {' '.join(words)} failed")
    return used


def cpu_seconds_of(command):
    used = used_by(command)
    return used.ru_utime + used.ru_stime
