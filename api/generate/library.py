"""The types of the client library that control.idl has: the public structs, how they are made of samples, and their members.

A type of the library is one of the contract without "Status": HostStatus is Host. A member keeps its name but for its unit,
which its C++ type has. The key that names the thing itself is `name`. Left out are `epoch`, `round`, `ext` and what HostStatus counts.
The types are those that HostStatus counts, and those with `library:`. That line says what is otherwise, in parts with ";" between: "as
NAME" (of the type), "MEMBER as NAME", "without MEMBER", and "extended". The last one means that plchost_client.hpp has a type of that
name with more members.
"""

import dataclasses
import re
import textwrap

from contract import Fault

LEFT_OUT = ("epoch", "round", "ext", "counts")
SEPARATORS = {"commas": "','", "line feeds": r"'\n'"}
NUMBERS = {
    "short": "int",
    "long": "int",
    "long long": "long long",
    "octet": "unsigned",
    "unsigned short": "unsigned",
    "unsigned long": "unsigned",
    "unsigned long long": "unsigned long long",
    "float": "float",
    "double": "double",
}


@dataclasses.dataclass
class Field:
    name: str
    type: str  # in C++
    value: str  # of `sample`, as that type
    text: str
    key: bool


@dataclasses.dataclass
class Record:
    name: str
    sample: str
    text: str
    topic: bool
    removable: bool  # a watch tells that it was removed
    extended: bool  # plchost_client.hpp has more of it
    fields: list


def title(text):
    """The beginning of a comment, which names the thing."""
    return re.split(r"[.:,;] ", text)[0].removesuffix(".")


@dataclasses.dataclass
class Told:
    """The tag `library:` of a type."""

    name: str  # of the type
    names: dict  # of members: another one
    left_out: set
    extended: bool = False


def told_of(kind):
    """Fault: the tag is not understood, or names no member."""
    told = Told(kind.name.removesuffix("Status"), {}, set(LEFT_OUT))
    for part in re.split(r";\s*", kind.tags["library"]) if "library" in kind.tags else []:
        found = re.fullmatch(r"(?:(?P<without>without) )?(?P<member>\w+)|(?:(?P<renamed>\w+) )?as (?P<name>\w+)", part)
        member = found and (found["renamed"] or found["without"] and found["member"])
        if not found or (found["member"] and not found["without"] and part != "extended"):
            raise Fault(f"{kind.name}: 'library:' has '{part}', which is not understood")
        if member and member not in (other.name for other in kind.members):
            raise Fault(f"{kind.name}: 'library:' names {member}, which is no member")
        if part == "extended":
            told.extended = True
        elif found["without"]:
            told.left_out.add(member)
        elif member:
            told.names[member] = found["name"]
        else:
            told.name = found["name"]
    return told


def field_of(kind, member, told, words, nested):
    base, _, count = member.type.partition("[")
    from_sample = f"sample.{member.name}"
    name, text = told.names.get(member.name, member.name), member.comment
    if member.key and name == told.name.lower():
        name, text = "name", ""
    sequence = re.fullmatch(r"sequence<(\w+), \d+>", base)
    if base == "octet" and count:
        made = ("std::string", f"hex_text(std::to_array({from_sample}))")
    elif words:
        coded = re.fullmatch(r"as (\w+)", member.comment)
        made = ("std::string", f"dds::word_for(dds::words::{kind.name}::{coded[1] if coded else member.name}, {from_sample})")
        text = ", ".join(words)
    elif base.startswith("string<"):
        between = re.search(r", with (commas|line feeds) between", member.comment)
        text = text.replace(between[0], "") if between else text
        made = ("std::vector<std::string>", f"list_in(dds::text_of({from_sample}), {SEPARATORS[between[1]]})") if between else (
            "std::string", f"printable_lines(dds::text_of({from_sample}))")
    elif base == "boolean":
        made = ("bool", from_sample)
    elif name.endswith("_unix_ns"):
        name = name.removesuffix("_unix_ns")
        made = ("std::chrono::system_clock::time_point", f"wall_time({from_sample})")
    elif name.endswith("_ns"):
        name = name.removesuffix("_ns")
        one = "std::chrono::nanoseconds"
        made = (f"std::array<{one}, {count[:-1]}>", f"durations(std::to_array({from_sample}))") if count else (one, f"{one}({from_sample})")
    elif base in NUMBERS and not count:
        made = (NUMBERS[base], from_sample)
    elif base in nested and not count:
        made = (nested[base], f"to_public({from_sample})")
    elif sequence and sequence[1] in nested:
        made = (f"std::vector<{nested[sequence[1]]}>", f"all_public({from_sample}, [](const auto& part) {{ return to_public(part); }})")
    else:
        raise Fault(f"{kind.name}: the client library has no type for {member.type} {member.name}")
    return Field(name, *made, re.sub(r"_ns\b", "", text), member.key)


def records_of(contract, counted, words_of):
    """The types of the library, each behind those that it has parts of."""
    by_name = {kind.name: kind for kind in contract.types}
    nested = {kind.name: told_of(kind).name for kind in contract.types if not kind.is_topic}
    made = {}

    def add(kind):
        if kind.name in made:
            return
        told = told_of(kind)
        members = [member for member in kind.members if member.name not in told.left_out]
        for member in members:
            for part in re.findall(r"\w+", member.type):
                if part in nested:
                    add(by_name[part])
        of_name = {member.name: member for member in members}
        fields = []
        for member in members:
            coded = re.fullmatch(r"as (\w+)", member.comment)  # another member
            words = words_of(of_name.get(coded[1], member) if coded else member)
            fields.append(field_of(kind, member, told, words, nested))
        removable = kind.name in counted
        made[kind.name] = Record(told.name, f"plc_{kind.name}", title(kind.comment), kind.is_topic, removable, told.extended, fields)

    for kind in contract.types:
        if kind.name in counted or "library" in kind.tags:
            add(kind)
    return list(made.values())


def initial(field):
    plain = {"bool": " = false"} | {number: " = 0" for number in NUMBERS.values()}
    return plain.get(field.type, "{}" if field.type.startswith("std::chrono") or field.type.startswith("std::array") else "")


def public_types(records):
    lines = [
        "// The types of the client library that api/control.idl has; made from it by api/generate/generate.py. See",
        "// plchost_client.hpp. Durations and times of the host are in the unit of their type, codes are words: a code that",
        "// this version does not know is its number. The reference of the contract, api/reference.md, has the rest.",
        "#ifndef PLCHOST_CLIENT_TYPES_HPP",
        "#define PLCHOST_CLIENT_TYPES_HPP\n",
        "#include <array>\n#include <chrono>\n#include <string>\n#include <vector>\n",
        "namespace plchost::client_types {",
    ]
    for record in records:
        lines += ["", f"/// {record.text}.", f"struct {record.name} {{"]
        for field in record.fields:
            text = f"  ///< {field.text}" if field.text else ""
            lines.append(f"  {field.type} {field.name}{initial(field)};{text}")
        if record.removable:
            lines.append("  bool removed = false;  ///< told by watches only: the host has it no more")
        names = [field.name for field in record.fields] + (["removed"] if record.removable else [])
        each = "&& ".join(f"a.{name}==b.{name}" for name in names)
        each = textwrap.fill(each, 100, subsequent_indent=" " * 11, break_long_words=False).replace("==", " == ").replace("&&", " &&")
        lines += ["", f"  friend bool operator==(const {record.name}& a, const {record.name}& b) {{"]
        lines += [f"    return {each};", "  }"]
        lines += [f"  friend bool operator!=(const {record.name}& a, const {record.name}& b) {{ return !(a == b); }}", "};"]
    return "\n".join(lines + ["", "}  // namespace plchost::client_types\n", "#endif\n"])


def conversions(records, head):
    lines = [head + "#include <array>\n#include <string>\n#include <string_view>\n#include <vector>\n"]
    lines += ["#include <code_words.hpp>\n#include <control.h>\n", '#include "api/dds/field_info.hpp"', '#include "api/dds/text.hpp"']
    lines += ['#include "api/library/convert_parts.hpp"', '#include "plchost_client_types.hpp"\n', "namespace plchost {"]
    for record in records:
        lines += ["", f"[[nodiscard]] inline client_types::{record.name} to_public(const {record.sample}& sample) {{"]
        lines.append(f"  client_types::{record.name} made;")
        lines += [f"  made.{field.name} = {field.value};" for field in record.fields]
        lines += ["  return made;", "}"]
        if record.removable:
            keys = [field.name if field.type == "std::string" else f"std::to_string(item.{field.name})" for field in record.fields if field.key]
            keys = [key if key.startswith("std") else f"item.{key}" for key in keys]
            lines += [f"[[nodiscard]] inline std::vector<std::string> key_of(const client_types::{record.name}& item) {{"]
            lines += [f"  return {{{', '.join(keys)}}};", "}"]
    return "\n".join(lines + ["\n}  // namespace plchost\n"])


def members(records, head):
    lines = [head + "#include <type_traits>\n", '#include "plchost_client_types.hpp"\n', "namespace plchost::client_types {\n"]
    lines.append("// visit(name, member, text) for each member of a type.")
    for record in records:
        lines += ["template <class Visit>", f"void visit_members(std::type_identity<{record.name}> /*type*/, Visit&& visit) {{"]
        names = [(field.name, field.text) for field in record.fields]
        names += [("removed", "told by watches only: the host has it no more")] if record.removable else []
        for name, text in names:
            quoted = text.replace("\\", "\\\\").replace('"', '\\"')
            lines.append(f'  visit("{name}", &{record.name}::{name}, "{quoted}");')
        lines.append("}\n")
    lines += ["/// visit(name, type, text) for each type that plchost_client.hpp has no more of.", "template <class Visit>", "void visit_types(Visit&& visit) {"]
    lines += [f'  visit("{record.name}", std::type_identity<{record.name}>(), "{record.text}.");' for record in records if not record.extended]
    return "\n".join(lines + ["}\n", "}  // namespace plchost::client_types\n"])
