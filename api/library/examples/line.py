#!/usr/bin/env python3
"""Shows what runs on a host, posts an event and watches the tasks: line.py HOST INSTANCE/EVENT

Finds plchost_client by PYTHONPATH; the DDS domain is PLCHOST_DOMAIN.
"""
import os
import sys
import threading

import plchost_client


def main(host, event):
    client = plchost_client.Client(domain=int(os.environ.get("PLCHOST_DOMAIN", "0")), timeout=10.0)
    for instance in client.instances(host):
        print(f"{instance.name}: {instance.state} under {instance.scheduler}")

    ran = threading.Event()

    def on_task(task):
        if task.external_event == event.split("/")[1] and task.cycles > 0:
            ran.set()

    with client.watch_tasks(host, on_task):
        print(f"posted: {client.post(host, event).accepted}")
        print("a task ran" if ran.wait(10) else "no task ran")
    try:
        client.post(host, "nobody/nothing")
    except plchost_client.ClientError as error:
        print(f"refused with code {error.code}: {error}")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
