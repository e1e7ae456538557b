#!/usr/bin/env python3
"""Makes C++ from control.idl; the build runs it: generate.py CONTROL.idl FOLDER

  FOLDER/topic_table.hpp          each topic: name, type, partition, QoS
  FOLDER/status_topics.hpp        the status topics: all types, how HostStatus counts them, in which order they are shown
  FOLDER/code_words.hpp           the words for their codes, and for those of all other types
  FOLDER/status_fields.hpp        their fields with unit and words, the rows of plcctl, and how it lists them
  FOLDER/contract_operations.hpp  each OPERATION_: name, number, role, whether it names an instance
  FOLDER/contract_bounds.hpp      how many parts each sequence may have
  FOLDER/topic_names.hpp          the names of the topics, by who writes them for whom, for permissions
  FOLDER/plchost_client_types.hpp  the public structs of the client library
  FOLDER/library_conversions.hpp  how they are made of samples
  FOLDER/library_members.hpp      their members, for Python
The same contract makes the same files.
"""

import pathlib
import re
import sys

sys.dont_write_bytecode = True
import library  # noqa: E402
from contract import Fault, names_of, parse, partition_of, qos_of  # noqa: E402
from rows import code_words, status_fields, value_of, words_of  # noqa: E402

HEAD = "// Made from api/control.idl by api/generate/generate.py.\n#pragma once\n\n"
ROLES = {"all": "Viewer", "op": "Operator", "eng": "Engineer"}


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


STATUS = "plc/v1/status/"


def counted(contract):
    """The status topics that HostStatus counts."""
    for kind in contract.types:
        name = names_of(kind)[0] if kind.is_topic else ""
        if name.startswith(STATUS) and kind.name != "HostStatus" and "uncounted" not in kind.tags:
            yield kind, name.removeprefix(STATUS)


def order_of(kind):
    """The members that put the samples of one host in order: its keys, if nothing else is said."""
    members = {member.name: member for member in kind.members}
    told = kind.tags.get("order")
    names = re.split(r",\s*", told) if told else [m.name for m in kind.members if m.key and m.name != "host"]
    for name in names:
        if name not in members:
            raise Fault(f"{kind.name}: 'order:' names {name}, which is no member")
    return [members[name] for name in names]


def status_topics(contract):
    all_of_them = list(counted(contract))
    lines = [HEAD + "#include <array>\n#include <string_view>\n#include <tuple>\n", "#include <control.h>\n"]
    lines += ['#include "api/dds/text.hpp"\n', "namespace plchost::dds {\n"]
    lines += ["/// Of<...> of the types of all status topics that HostStatus counts.", "template <template <class...> class Of>"]
    lines.append(f"using OfCountedStatus = Of<{', '.join(f'plc_{kind.name}' for kind, _ in all_of_them)}>;\n")
    lines += ["/// The name of a topic in HostStatus.", "template <class Sample>", "inline constexpr std::string_view kCountedAs{};"]
    for kind, name in all_of_them:
        lines.append(f'template <>\ninline constexpr std::string_view kCountedAs<plc_{kind.name}> = "{name}";')
    lines.append("\n// By which samples of one host are sorted.")
    for kind, _ in all_of_them:
        values = ", ".join(value_of(member) for member in order_of(kind))
        lines.append(f"inline auto order_of(const plc_{kind.name}& sample) {{ return std::tuple({values}); }}")
    return "\n".join(lines + ["\n}  // namespace plchost::dds\n"])


def contract_operations(contract):
    lines = [HEAD + "#include <array>\n#include <cstdint>\n#include <string_view>\n", "namespace plchost {\n"]
    lines += ["/// An operation as the contract has it; shm/operations/operations.hpp is what the programs go by.", "struct ContractOperation {"]
    lines += ["  std::string_view name;  ///< \"reset cold\"", "  std::int32_t number;", "  std::string_view role;  ///< of its topic: \"eng\"", "  bool names_instance;", "};\n"]
    lines.append("inline constexpr std::array kContractOperations{")
    for constant in contract.constants:
        name = constant.name.removeprefix("OPERATION_").lower().replace("_", " ")
        told = re.match(rf"({'|'.join(ROLES)}): +(no instance)?", constant.comment)
        if not told:
            raise Fault(f"{constant.name}: its comment does not begin with the role of a topic: {', '.join(ROLES)}")
        names_instance = cpp_bool(not told[2])
        lines.append(f'    ContractOperation{{"{name}", {constant.value}, "{told[1]}", {names_instance}}},')
    return "\n".join(lines + ["};\n", "}  // namespace plchost\n"])


def contract_bounds(contract):
    lines = [HEAD + "#include <cstddef>\n", "namespace plchost::dds::bounds {\n"]
    lines.append("// The bounds of the sequences of each type: bounds::EventBatch::events.")
    for kind in contract.types:
        bounds = [(m.name, re.fullmatch(r"sequence<\w+, (\d+)>", m.type)) for m in kind.members if m.name != "ext"]
        bounds = [(name, found[1]) for name, found in bounds if found]
        if bounds:
            lines.append(f"struct {kind.name} {{")
            lines += [f"  static constexpr std::size_t {name} = {bound};" for name, bound in bounds]
            lines.append("};")
    return "\n".join(lines + ["\n}  // namespace plchost::dds::bounds\n"])


def topic_names(contract):
    """Permissions outlive a version, so they name all status topics by their folder, and those of a role, too."""
    of_partition = {letter: [] for letter in PARTITIONS}
    for kind in (kind for kind in contract.types if kind.is_topic):
        for name in names_of(kind):
            folder = re.match(r"plc/v\d+/(?:status|%s)/" % "|".join(ROLES), name)
            if folder and folder[0].endswith("/status/"):
                name = folder[0] + "*"
            names = of_partition[partition_of(kind)]
            if name not in names and (not folder or name.endswith("*")):
                names.append(name)
    lines = [HEAD + "#include <array>\n#include <string_view>\n", "namespace plchost::topic_names {\n"]
    lines.append("// By partition; of those for a host without those of a role, which have a folder of their own.")
    for letter, what in PARTITIONS.items():
        told = ", ".join(f'"{name}"' for name in of_partition[letter])
        lines.append(f"inline constexpr std::array<std::string_view, {len(of_partition[letter])}> k{what.capitalize()}{{{told}}};")
    lines.append("\n// The beginning of the partition's name.")
    for letter, what in PARTITIONS.items():
        lines.append(f'inline constexpr std::string_view k{what.capitalize()}Partition = "{letter}.";')
    lines.append("\n// Each by itself; those of a role by its folder; the requests of all roles.")
    for kind in (kind for kind in contract.types if kind.is_topic):
        lines += [f'inline constexpr std::string_view {constant_of(kind, name)} = "{name}";' for name in names_of(kind)]
    requests = names_of(next(kind for kind in contract.types if kind.name == "Request"))
    lines += [f'inline constexpr std::string_view k{ROLES[name.split("/")[2]]}Topics = "{name.rpartition("/")[0]}/*";' for name in requests]
    (each,) = {re.sub(rf"/({'|'.join(ROLES)})/", "/*/", name) for name in requests}
    lines.append(f'inline constexpr std::string_view kRequests = "{each}";')
    return "\n".join(lines + ["\n}  // namespace plchost::topic_names\n"])


PARTITIONS = {"h": "host", "s": "status", "c": "client", "n": "name", "b": "blocks"}


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[2])
    try:
        contract = parse(pathlib.Path(sys.argv[1]))
        records = library.records_of(contract, [kind.name for kind, _ in counted(contract)], words_of)
        made = {
            "topic_table.hpp": topic_table(contract),
            "status_topics.hpp": status_topics(contract),
            "code_words.hpp": code_words(contract, HEAD),
            "status_fields.hpp": status_fields(contract, [kind for kind, _ in counted(contract)], HEAD),
            "contract_operations.hpp": contract_operations(contract),
            "contract_bounds.hpp": contract_bounds(contract),
            "topic_names.hpp": topic_names(contract),
            "plchost_client_types.hpp": library.public_types(records),
            "library_conversions.hpp": library.conversions(records, HEAD),
            "library_members.hpp": library.members(records, HEAD),
        }
    except Fault as fault:
        sys.exit(str(fault))
    for name, text in made.items():
        (folder / name).write_text(text)


if __name__ == "__main__":
    main()
