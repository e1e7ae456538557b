"""The rows and tables of plcctl that control.idl has: the fields of a row with their names, units and words, and its columns."""

import dataclasses
import re

from contract import Fault, Member


def words_of(member):
    """The words for the codes of a member: its comment begins with "0 offline, 1 starting. 2 running". Brackets, and all behind
    the codes, are left out."""
    words = []
    for part in re.split("[,;.] ", re.sub(r" \([^)]*\)", "", member.comment)):
        found = re.fullmatch(rf"{len(words)} ([a-z -]+)", part)
        if not found:
            break
        words.append(found[1].replace(" ", "_"))
    return words if len(words) > 1 else []


def single_members(kind):
    """The members but for sequences; `epoch` is none of a row's."""
    return [member for member in kind.members if member.name != "epoch" and not member.type.startswith("sequence")]


def is_part(contract, member):
    """It has members of its own."""
    return member.type.split("[")[0] in (other.name for other in contract.types if not other.is_topic)


def plain_members(contract, kind):
    """Those that are one value."""
    return [member for member in single_members(kind) if not is_part(contract, member)]


def value_of(member, sample="sample"):
    """A member as C++ compares it."""
    if member.type.startswith("string<"):
        return f"text_of({sample}.{member.name})"
    return f"std::to_array({sample}.{member.name})" if "[" in member.type else f"{sample}.{member.name}"


@dataclasses.dataclass
class RowField:
    row: str  # its name in rows
    member: Member  # None: it is computed
    form: str = ""  # of a time: "text", "number"; else both
    null: str = ""

    @property
    def unit(self):
        name = self.member.name if self.member and self.form != "number" else ""
        if name.endswith("_unix_ns"):
            return "unix_text" if self.form == "text" else "unix"
        return "duration" if name.endswith("_ns") else "none"

    @property
    def base(self):
        return re.sub(r"(_unix)?_ns$", "", self.row) if self.unit != "none" else self.row

    @property
    def shown(self):
        """The field of the row that a table shows."""
        return f"{self.base}_us" if self.unit == "duration" else self.base

    def info(self, kind):
        told = [f'.name = "{self.member.name if self.member else self.row}"', f'.row = "{self.row}"', f'.base = "{self.base}"']
        told += [f".unit = Unit::{self.unit}"] if self.unit != "none" else []
        told += [".key = true"] if self.member and self.member.key else []
        told += [f".words = words::{kind.name}::{self.member.name}"] if self.member and words_of(self.member) else []
        told += [".null_if_empty = true" if self.null == "empty" else f".null = {self.null}"] if self.null else []
        return f"FieldInfo{{{', '.join(told)}}}"


def listed(kind, tag):
    """The parts of a tag."""
    return re.split(r"[,;]\s*", kind.tags[tag]) if tag in kind.tags else []


PART = re.compile(
    r"(?P<without>without )?(?P<name>\w+)(?: (?P<form>computed|text|number))?(?: null (?P<null>-?\d+|empty))?(?: as (?P<row>\w+))?"
)


def row_fields(contract, kind):
    """The fields and parts of a row: those of `row:` in its order. A member that it does not name stays behind the one before it."""
    members = {member.name: member for member in single_members(kind)}
    fields, named = [], set()
    for part in listed(kind, "row"):
        found = PART.fullmatch(part)
        if not found or (found["form"] != "computed" and found["name"] not in members):
            raise Fault(f"{kind.name}: 'row:' has '{part}', which is not understood or no member")
        if found["form"] in ("text", "number") and not found["name"].endswith("_ns"):
            raise Fault(f"{kind.name}: 'row:' has '{part}', which is no time")
        named.add(found["name"])
        if not found["without"]:
            member = None if found["form"] == "computed" else members[found["name"]]
            fields.append((found["name"], RowField(found["row"] or found["name"], member, found["form"] or "", found["null"] or "")))
    before = None
    for name, member in members.items():
        if name not in named:
            behind = [i for i, (other, _) in enumerate(fields) if other == before]
            fields.insert(behind[-1] + 1 if behind else 0, (name, RowField(name, member)))
        before = name if any(other == name for other, _ in fields) else before
    return fields


COLUMN = re.compile(
    r"(?P<name>\w+)(?: (?P<rank>\d+))?(?: none (?P<none>-?\d+))?(?: decimals (?P<decimals>\d))?(?: as (?P<header>\S+(?: \S+)*))?"
)


def columns(contract, kind):
    """The ColumnInfo of each part of `columns:`. Fault: it is not understood, or names no field of the row."""
    fields, lines = row_fields(contract, kind), []
    for part in listed(kind, "columns"):
        found = COLUMN.fullmatch(part)
        named = [field for name, field in fields if found and name == found["name"]]
        if not named:
            raise Fault(f"{kind.name}: 'columns:' has '{part}', which is not understood or no field of the row")
        field = named[0]
        header = found["header"] or field.base.upper().replace("_", "-")
        header += "(us)" if field.unit == "duration" else ""
        told = [f'.field = "{field.shown}"', f'.header = "{header}"']
        told += [f".decimals = {found['decimals']}"] if found["decimals"] else []
        told += [f".rank = {found['rank']}"] if found["rank"] else []
        told += [f".none = {found['none']}"] if found["none"] else []
        lines.append(f"    ColumnInfo{{{', '.join(told)}}},")
    return lines


def code_words(contract, head):
    """The words for codes, of each member that has any: words::TaskStatus::kind."""
    lines = [head + "#include <array>\n#include <string_view>\n", "namespace plchost::dds::words {\n"]
    lines.append("// The names of the contract. NOLINTBEGIN(readability-identifier-naming)")
    for kind in contract.types:
        members = [(member.name, words_of(member)) for member in kind.members if words_of(member)]
        lines += [f"struct {kind.name} {{"] if members else []
        for name, words in members:
            told = ", ".join(f'"{word}"' for word in words)
            lines.append(f"  static constexpr std::array<std::string_view, {len(words)}> {name}{{{told}}};")
        lines += ["};"] if members else []
    lines.append("// NOLINTEND(readability-identifier-naming)")
    return "\n".join(lines + ["\n}  // namespace plchost::dds::words\n"])


def fields_of(contract, kind):
    """visit_fields() of a type."""
    lines = ["template <class Visit>", f"void visit_fields(const plc_{kind.name}& sample, Visit&& visit) {{"]
    for member in plain_members(contract, kind):
        lines.append(f"  visit({RowField(member.name, member).info(kind)}, {value_of(member)});")
    return lines + ["}\n"]


def row_of(contract, kind):
    """visit_row() of a type, Computed, its fields that are computed, and visit_parts(), if it has any."""
    fields, parts = [], []
    for _, field in row_fields(contract, kind):
        (parts if field.member and is_part(contract, field.member) else fields).append(field)
    computed = [field.row for field in fields if not field.member]
    lines = []
    if computed:
        lines += ["template <class Value>", f"struct Computed<plc_{kind.name}, Value> {{"]
        lines += [f"  Value {name};" for name in computed] + ["};"]
    lines += [f"template <>\ninline constexpr bool kHasRow<plc_{kind.name}> = true;", "template <class Value, class Visit>"]
    lines.append(f"void visit_row(const plc_{kind.name}& sample, [[maybe_unused]] const Computed<plc_{kind.name}, Value>& computed,")
    lines.append("               Visit&& visit) {")
    for field in fields:
        lines.append(f"  visit({field.info(kind)}, {value_of(field.member) if field.member else f'computed.{field.row}'});")
    lines.append("}\n")
    if parts:
        lines += ["template <class Sample, class Visit>", f"  requires std::same_as<std::remove_const_t<Sample>, plc_{kind.name}>"]
        lines.append("constexpr void visit_parts(Sample& sample, Visit&& visit) {")
        for part in parts:
            text = part.member.comment.replace("\\", "\\\\").replace('"', '\\"')
            told = f'.name = "{part.member.name}", .row = "{part.row}", .text = "{text}"'
            lines.append(f"  visit(PartInfo{{{told}}}, sample.{part.member.name});")
        lines.append("}\n")
    return lines


def status_fields(contract, counted, head):
    """The fields of the status topics that HostStatus counts, and the rows of these and of other topics that plcctl shows."""
    lines = [head + "#include <array>\n#include <concepts>\n#include <string_view>\n#include <type_traits>\n"]
    lines += ["#include <code_words.hpp>", "#include <status_topics.hpp>\n"]
    lines += ['#include "api/dds/field_info.hpp"\n', "namespace plchost::dds {\n"]
    for kind in counted:
        lines += fields_of(contract, kind)
    for kind in contract.types:
        if kind not in counted and "row" not in kind.tags:
            continue
        lines += row_of(contract, kind)
        if "list" in kind.tags:
            noun, _, text = kind.tags["list"].partition(", ")
            lines.append(f'template <>\ninline constexpr Listing kListing<plc_{kind.name}>{{"{noun}", "{text}"}};')
        if "columns" in kind.tags:
            lines += ["template <>", f"inline constexpr std::array kColumns<plc_{kind.name}>{{", *columns(contract, kind), "};"]
    return "\n".join(lines + ["\n}  // namespace plchost::dds\n"])
