#!/usr/bin/env python3
"""A cable that is slow and loses packets, where the kernel has no netem: carries Ethernet frames between two interfaces.

slow_link.py INTERFACE INTERFACE DELAY_MS LOSS_PERCENT     each way; runs until it is ended
"""

import collections
import random
import select
import socket
import struct
import sys
import time

ETH_P_ALL = 3
ETH_P_IP = b"\x08\x00"
UDP = 17


def opened(interface):
    end = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETH_P_ALL))
    end.bind((interface, 0))
    end.setblocking(False)
    return end


def completed(frame):
    """Between virtual interfaces the checksum of UDP may still be left to a hardware: none is as good."""
    if frame[12:14] != ETH_P_IP or frame[23] != UDP:
        return frame
    first = struct.unpack("!H", frame[20:22])[0] & 0x1FFF == 0
    at = 14 + 4 * (frame[14] & 15) + 6
    return frame[:at] + b"\0\0" + frame[at + 2 :] if first and len(frame) >= at + 2 else frame


def main():
    ends = [opened(name) for name in sys.argv[1:3]]
    delay, loss = float(sys.argv[3]) / 1000, float(sys.argv[4]) / 100
    under_way = collections.deque()  # due, where to, frame: in the order of their times
    chance = random.Random(1)
    print("carries", flush=True)
    while True:
        now = time.monotonic()
        while under_way and under_way[0][0] <= now:
            _, end, frame = under_way.popleft()
            try:
                end.send(frame)
            except OSError:  # the other end is down, or full
                pass
        wait = under_way[0][0] - now if under_way else None
        for end in select.select(ends, [], [], wait)[0]:
            other = ends[1] if end is ends[0] else ends[0]
            try:
                frame, address = end.recvfrom(65536)
            except OSError:  # the interface went down
                continue
            if address[2] == socket.PACKET_OUTGOING or chance.random() < loss:
                continue
            under_way.append((time.monotonic() + delay, other, completed(frame)))


main()
