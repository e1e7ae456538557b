#!/usr/bin/env python3
"""Looks into the pool from Python, through ctypes: lists its objects, and posts to an event if one is named.

    look.py LIBRARY POOL [EVENT]
"""
import ctypes
import sys


class ObjectInfo(ctypes.Structure):
    _fields_ = [("name", ctypes.c_char_p), ("type", ctypes.c_uint), ("references", ctypes.c_uint),
                ("waiters", ctypes.c_uint), ("kept", ctypes.c_uint), ("value", ctypes.c_ulong),
                ("size", ctypes.c_ulong)]


VISITOR = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ObjectInfo), ctypes.c_void_p)
TYPES = ["memory", "semaphore", "event", "mutex"]
READ_WRITE = 1


def main(library, pool_name, event_name=None):
    plc = ctypes.CDLL(library)
    plc.plc_pool_error.restype = ctypes.c_char_p
    plc.plc_event_count.restype = ctypes.c_ulong

    def done(result):
        if result < 0:
            sys.exit("look.py: " + plc.plc_pool_error().decode())
        return result

    pool = ctypes.c_void_p()
    done(plc.plc_pool_open(pool_name.encode(), READ_WRITE, ctypes.byref(pool)))
    if event_name:
        event = ctypes.c_void_p()
        done(plc.plc_event_open(pool, event_name.encode(), READ_WRITE, ctypes.byref(event)))
        done(plc.plc_event_post(event))
        print(event_name, "was posted", plc.plc_event_count(event), "times")
        plc.plc_event_close(event)

    @VISITOR
    def show(info, _):
        it = info.contents
        what = f"{it.size} bytes" if it.type == 0 else f"value {it.value}"
        print(f"{it.name.decode()}: {TYPES[it.type]}, {what}, {it.references} references")
        return 0

    done(plc.plc_pool_list(pool, show, None))
    plc.plc_pool_close(pool)


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    main(*sys.argv[1:])
