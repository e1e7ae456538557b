#!/usr/bin/env python3
"""Prints the number of a DDS domain that no other test of this machine has, and has it until its parent process ends.

Usage: hold_domain.py PARENT (the process ID of the parent, which may have ended before this program begins)

The last port of a domain is used by no participant: the process that has bound it has the domain. So a run in a root of
its own, but with the network of the machine, is seen too.
"""

import ctypes
import os
import signal
import socket
import sys

PR_SET_PDEATHSIG = 1
ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
if os.getppid() != int(sys.argv[1]):
    sys.exit("the test has ended")
# Above the ports that the kernel gives to clients.
for domain in range(215, 231):
    holder = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        holder.bind(("127.0.0.1", 7400 + 250 * domain + 249))
    except OSError:
        holder.close()
        continue
    print(domain, flush=True)
    signal.pause()
sys.exit("no DDS domain is free for this test")
