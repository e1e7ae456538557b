#!/usr/bin/env python3
"""Makes a version of the contract that comes after control.idl: next_version.py CONTROL.idl NEXT.idl

It grows in each way that the head of control.idl allows. It gets a topic (RecipeStatus), an operation (OPERATION_BAKE),
entries of `ext` ("recipe" of InstanceStatus, LogRecord, Request and EventPost) and a code (InstanceStatus.state 77). The last
two need no line here.
"""

import pathlib
import re
import sys

TOPIC = """
  // A recipe.
  // topic: plc/v1/status/recipe
  // writer: host, in partition s.<host>
  // reader: all
  // qos: as HostStatus
  @final @topic
  struct RecipeStatus {
    @key string<63> host;
    @key string<31> recipe;  // its name
    unsigned long long epoch;
    unsigned long loaves;    // that were baked
    sequence<KeyValue, 16> ext;
  };
"""


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    text = pathlib.Path(sys.argv[1]).read_text()
    operations = list(re.finditer(r"const long OPERATION_\w+\s*= (\d+);[^\n]*\n(?:\s+//[^\n]*\n)*", text))
    last = operations[-1]
    number = max(int(operation[1]) for operation in operations) + 1
    bake = f"  const long OPERATION_BAKE = {number};  // op:  bakes a loaf\n"
    end = text.rindex("};")
    pathlib.Path(sys.argv[2]).write_text(text[: last.end()] + bake + text[last.end() : end] + TOPIC + text[end:])


if __name__ == "__main__":
    main()
