#!/usr/bin/env python3
"""Makes C++ from control.idl; the build runs it: generate.py CONTROL.idl FOLDER

  FOLDER/topic_table.hpp          each topic: name, type, partition, QoS
  FOLDER/contract_operations.hpp  each OPERATION_: name, number, role, whether it names an instance
The same contract makes the same files.
"""

import pathlib
import re
import sys

sys.dont_write_bytecode = True
from contract import Fault, names_of, parse, partition_of, qos_of  # noqa: E402

HEAD = "// Made from api/control.idl by api/generate/generate.py.\n#pragma once\n\n"
ROLES = {"op": "Operator", "eng": "Engineer"}


def constant_of(kind, name):
    """kReply; of a type with a topic for each role: kOperatorRequest."""
    role = re.match(r"plc/v\d+/(\w+)/", name)
    return f"k{ROLES[role[1]] if len(names_of(kind)) > 1 else ''}{kind.name}"


def cpp_bool(value):
    return "true" if value else "false"


def topic_table(contract):
    lines = [HEAD + "#include <control.h>\n", '#include "api/dds/topic_info.hpp"\n', "namespace plchost::dds {\n"]
    for kind in (kind for kind in contract.types if kind.is_topic):
        qos = qos_of(contract, kind)
        told = [
            f".blocking = std::chrono::milliseconds({qos.blocking_ms})",
            f".depth = {qos.depth}",
            f".transient_local = {cpp_bool(qos.transient_local)}",
            f".autodispose = {cpp_bool(qos.autodispose)}",
            f".deadline = std::chrono::milliseconds({qos.deadline_ms})",
            f".reader_holds = {qos.reader_holds}",
        ]
        for name in names_of(kind):
            lines.append(f"inline constexpr TopicInfo {constant_of(kind, name)}{{")
            lines.append(f'    .name = "{name}",')
            lines.append(f"    .type = &plc_{kind.name}_desc,")
            lines.append(f"    .partition = Partition::{PARTITIONS[partition_of(kind)]},")
            lines.append(f"    .qos = {{{', '.join(told)}}}}};")
        if len(names_of(kind)) == 1:
            lines.append("template <>")
            lines.append(f"inline constexpr const TopicInfo& kTopicOf<plc_{kind.name}> = k{kind.name};")
    lines += ["\n/// All of them, in the order of the contract.", "inline constexpr std::array kTopics{"]
    for kind in (kind for kind in contract.types if kind.is_topic):
        lines += [f"    {constant_of(kind, name)}," for name in names_of(kind)]
    return "\n".join(lines + ["};\n", "}  // namespace plchost::dds\n"])


def contract_operations(contract):
    lines = [HEAD + "#include <array>\n#include <cstdint>\n#include <string_view>\n", "namespace plchost {\n"]
    lines += ["/// An operation as the contract has it; shm/base/operations.hpp is what the programs go by.", "struct ContractOperation {"]
    lines += ["  std::string_view name;  ///< \"reset cold\"", "  std::int32_t number;", "  bool engineering;", "  bool names_instance;", "};\n"]
    lines.append("inline constexpr std::array kContractOperations{")
    for constant in contract.constants:
        name = constant.name.removeprefix("OPERATION_").lower().replace("_", " ")
        told = re.match(r"(op|eng): +(no instance)?", constant.comment)
        if not told:
            raise Fault(f"{constant.name}: its comment does not begin with 'op:' or 'eng:'")
        engineering, names_instance = cpp_bool(told[1] == "eng"), cpp_bool(not told[2])
        lines.append(f'    ContractOperation{{"{name}", {constant.value}, {engineering}, {names_instance}}},')
    return "\n".join(lines + ["};\n", "}  // namespace plchost\n"])


PARTITIONS = {"h": "host", "s": "status", "c": "client", "n": "name", "b": "blocks"}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[2])
    try:
        contract = parse(pathlib.Path(sys.argv[1]))
        made = {"topic_table.hpp": topic_table(contract), "contract_operations.hpp": contract_operations(contract)}
    except Fault as fault:
        sys.exit(str(fault))
    for name, text in made.items():
        (folder / name).write_text(text)


if __name__ == "__main__":
    main()
