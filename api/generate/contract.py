"""Reads control.idl: types, members, constants, and what their comments say of topics."""

import dataclasses
import re

TAGS = ("topic", "writer", "reader", "qos")
OPTIONAL_TAGS = ("uncounted", "order", "list", "row", "columns", "library")


@dataclasses.dataclass
class Member:
    """A member of a struct, or a constant; then `name` is what stands left of the `=`."""

    name: str
    type: str
    line: int
    key: bool = False
    value: str = ""
    comment: str = ""


@dataclasses.dataclass
class Type:
    name: str
    line: int
    annotations: str
    comment: str
    tags: dict
    members: list = dataclasses.field(default_factory=list)

    @property
    def is_topic(self):
        return "@topic" in self.annotations


@dataclasses.dataclass
class Contract:
    head: str
    common: dict  # fields that mean the same everywhere: name -> meaning
    constants: list
    constants_comment: str
    types: list


class Fault(Exception):
    pass


def split_tags(lines):
    """A comment's text, and what stands behind `topic:` and the like."""
    text, tags, current = [], {}, None
    for line in lines:
        tag = re.match(r"(%s):\s+(.*)" % "|".join(TAGS + OPTIONAL_TAGS), line)
        if tag:
            current = tag[1]
            tags[current] = tag[2]
        elif current:
            tags[current] += " " + line.strip()
        else:
            text.append(line.strip())
    return " ".join(text), tags


def common_fields(head):
    """The table of fields at the end of the head: `  name  meaning`, longer meanings go on below."""
    fields, current = {}, None
    for line in head:
        entry = re.match(r"  (\w+)\s{2,}(\S.*)", line)
        if entry:
            current = entry[1]
            fields[current] = entry[2]
        elif current and line.startswith("   "):
            fields[current] += " " + line.strip()
    return fields


def parse(path):
    """Reads the part of IDL that control.idl uses; anything else is a Fault."""
    contract = Contract("", {}, [], "", [])
    comment, annotations, current, last = [], "", None, None
    for number, line in enumerate(path.read_text().splitlines(), 1):
        code, _, remark = line.partition("//")
        code, remark = code.strip(), remark.removeprefix(" ").rstrip()
        if not code:
            if not remark and "//" not in line:  # an empty line
                if comment and not contract.head:
                    contract.head = "\n".join(comment)
                    contract.common = common_fields(comment)
                comment, last = [], None
            elif last is not None:
                last.comment = (last.comment + " " + remark.strip()).strip()
            else:
                comment.append(remark)
            continue
        constant = re.fullmatch(r"const (.+?)\s+(\w+)\s*=\s*(\S+);", code)
        member = re.fullmatch(r"(@key )?(.+?)\s+(\w+)(\[\d+\])?;", code)
        if constant and not current:
            if comment:
                contract.constants_comment = " ".join(comment)
            last = Member(constant[2], constant[1], number, value=constant[3], comment=remark.strip())
            contract.constants.append(last)
            comment = []
        elif code.startswith("@") and not current:
            annotations = code
        elif re.fullmatch(r"struct \w+ \{", code):
            text, tags = split_tags(comment)
            current = Type(code.split()[1], number, annotations, text, tags)
            contract.types.append(current)
            comment, annotations, last = [], "", None
        elif current and member:
            kind = member[2] + (member[4] or "")
            last = Member(member[3], kind, number, key=bool(member[1]), comment=remark.strip())
            current.members.append(last)
        elif code == "};":
            current, last, comment = None, None, []
        elif not re.fullmatch(r"module \w+ \{", code):
            raise Fault(f"{path.name}:{number}: not understood: {code}")
    return contract


def meaning(contract, member):
    return member.comment or contract.common.get(member.name, "")


def quality(contract, kind):
    """The QoS of a topic; `as OTHER` is written out."""
    told = kind.tags["qos"]
    other = re.fullmatch(r"as (\w+)", told)
    if not other:
        return told
    found = [kind for kind in contract.types if kind.name == other[1] and kind.is_topic]
    if not found:
        raise Fault(f"{kind.name}: 'as {other[1]}': there is no such topic")
    return quality(contract, found[0])


@dataclasses.dataclass
class Qos:
    """The values of `qos:`, for programs."""

    blocking_ms: int  # of the writer
    depth: int  # 0: KEEP_ALL
    transient_local: bool
    autodispose: bool
    deadline_ms: int  # 0: none
    reader_holds: int  # samples; 0: no bound


QOS = re.compile(
    r"RELIABLE \((?P<blocking>\d+) ms\), (?:KEEP_ALL|KEEP_LAST (?P<depth>\d+)), (?P<durability>VOLATILE|TRANSIENT_LOCAL)"
    r"(?P<autodispose>, autodispose off)?(?:, DEADLINE (?P<deadline>\d+) ms)?"
    r"(?:; the (?:host's )?reader holds (?P<holds>\d+)(?: and .*)?)?"
)


def qos_of(contract, kind):
    """The QoS of a topic. Fault: it is not said in the words that are known."""
    told = quality(contract, kind)
    found = QOS.fullmatch(told)
    if not found:
        raise Fault(f"{kind.name}: this QoS is not understood: {told}")
    return Qos(
        blocking_ms=int(found["blocking"]),
        depth=int(found["depth"] or 0),
        transient_local=found["durability"] == "TRANSIENT_LOCAL",
        autodispose=not found["autodispose"],
        deadline_ms=int(found["deadline"] or 0),
        reader_holds=int(found["holds"] or 0),
    )


def names_of(kind):
    """The names of a type's topics."""
    return [name.strip() for name in kind.tags["topic"].split(",")]


def partition_of(kind):
    """The letter of the partitions that a topic is written into."""
    found = re.match(r"(?:client|host), in partition ([a-z])\.<", kind.tags["writer"])
    if not found:
        raise Fault(f"{kind.name}: this writer is not understood: {kind.tags['writer']}")
    return found[1]
