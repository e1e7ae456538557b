#!/usr/bin/env python3
"""The texts that git knows are written as a reader needs them: plain, short, active.

Usage: prose.py [ROOT] (a git checkout); prints each fault as "file:line: the fault".

* No sentence and no cell of a table begins with "who", "what", "whose", "whoever", "whatever" or "that which", unless it asks
  something. A part behind ":" or ";" or a dash is held to the same, and so is a clause behind "so", "because" and the like.
* No clause with "what" is an object where a noun belongs: "of what is posted". Comments are not held to this one.
* No sentence has the object of "who", a "who" behind "whether", or one that belongs to a "nobody" or "anybody" before it.
* No sentence has more than 30 words. Code in backticks is one word, a link counts as its text. A colon or ";" ends no sentence.
  A list of more is written as a list. Each line of a message of several lines is a sentence of its own.
* No cell of a table has more than 36 words, unless a program makes the table: the rest is a text below it.
* The text of an error of the programs does not begin with an imperative: "cannot open FILE", not "open FILE".
* No text has a word that manager/glossary.md forbids (the column "not"), nor its plural, nor its forms with -ed and -ing.

A text is a paragraph, a heading, an item of a list or a cell of a table outside of fences (.md). So are comments, docstrings and
the texts of pictures (.svg). Strings of three words and more in C++, Python or CMake, or printed by a shell script, are texts:
messages are among those. Not held are drawings and columns in comments, and raw strings. A message may be longer if it has
columns, a declaration in Structured Text or a regular expression.
"""

import argparse
import ast
import html
import io
import re
import subprocess
import sys
import tokenize
from pathlib import Path

GLOSSARY = "manager/glossary.md"
WORDS = 30
CELL_WORDS = 36

OPENING = re.compile(r"[^\w$]*(who|what|whose|whoever|whatever|that which)\b(?!-)", re.IGNORECASE)
# In the midst of a sentence: `so who asks`, `by who asks`, `because what is read`, `asks nobody for it who reads`.
WITHIN = re.compile(
    r"\b(?:(?:so|because|that|if|when|while|as|than|unless|since|until|of|by|for|from|to|with|but|and|or|nor|only|stop|whether) who"
    r"|(?:so|because|if|when|while|unless|since|but|so that) what|whom"
    r"|(?:nobody|no one|anybody|everybody|somebody)\b[^.;:]*?\bwho)\b|\bwhoever\b(?!\")", re.IGNORECASE)
# `says what is wrong` asks, `of what is wrong` does not.
OBJECT = re.compile(r"\b(?:of|for|from|with|by|without|beside|than|takes?|adopts?) what \w", re.IGNORECASE)
# The ends of sentences. A sentence begins with a capital letter, a digit, code, an option, or the name of an error and a colon.
# So does a line of a message: `\n` in C.
END_OF_SENTENCE = re.compile(r"(?<=[.!?])[\"')\]*]*\s+(?=[\"'(\[*]*(?:[A-Z0-9`\u0001]|--[a-z]|[a-z_]+: ))|\\n")
PART = re.compile(r"(?<=[:;])\s+|\s+[-\u2013]\s+")
WORD = re.compile(r"[\w'\u0001][\w'/.,\u0001-]*")
CODE = "\u0001"  # one word of code
# A call that makes an error. The step is its first literal.
ERROR_CALL = re.compile(r"\b(?:failure|failure_in|openssl_failure|check_(?:errno|returned|entity|code))\(")
CALL_PART = re.compile(r'"(?:\\.|[^"\\\n])*"|[()]')
IMPERATIVE = re.compile(
    r'"(accept|add|allocate|attach|bind|catch|change|choose|claim|connect|copy|create|empty|examine|filter|give|guard|join|listen|lock|look'
    r'|make|map|open|pass|poll|post|prepare|publish|raise|reach|read|receive|remove|rename|send|set|sign|signal|start|sync|tie|wait|watch'
    r'|write)[ "]')

C_TOKEN = re.compile(
    r"""//(?P<line>[^\n]*)|/\*(?P<block>.*?)\*/|R"(?P<mark>\w*)\((?P<raw>.*?)\)(?P=mark)"|"""
    r""""(?P<text>(?:\\.|[^"\\\n])*)"|(?<![0-9a-fA-F])'(?:\\.[^'\n]*|[^'\\\n])'""", re.DOTALL)
# Of a comment: columns, arrows, a line of usage.
DRAWING = re.compile(r"\S   +\S|-->|──|\|  |^  +\S.*\[-")
# Of a message: columns, a declaration in Structured Text, a regular expression.
NO_PROSE = re.compile(r"\S {3,}\S|\w : \w|\(\?P<")
# Of a comment in api/control.idl: lists of members.
FOR_GENERATORS = re.compile(r"(row|columns): ")
# In a comment of api/control.idl: a line for the generators.
TAG = re.compile(r"(topic|writer|reader|qos|row|columns|list|library|order|uncounted): ")
C_FILES = (".cpp", ".hpp", ".h", ".c", ".def", ".idl", ".h.in", ".hpp.in")
CMAKE_FILES = (".cmake", ".cmake.in", "CMakeLists.txt")
HASH_FILES = (*CMAKE_FILES, ".service.in", ".toml", ".sh", ".sed", ".ci/run", ".ci/packages", ".ci/bare",
              ".ci/debian_root")
CMAKE_TOKEN = re.compile(r"""#[^\n]*|"((?:\\.|[^"\\])*)\"""", re.DOTALL)
PICTURE_TEXT = re.compile(r"<(text|title|desc)\b[^>]*>(.*?)</\1>", re.DOTALL)
# Behind it, in a document, tables are made by a program.
MADE = re.compile(r"<!-- (generated: |.*It is made: )")
END_OF_MADE = "<!-- end of generated -->"
ITEM = re.compile(r"([*+-]|\d+\.|\([a-z0-9]\)) +(?=\S)")


class Text:
    """Lines of one paragraph, each with its number. `cell`: of a table that no program makes."""

    def __init__(self, cell=False):
        self.lines = []
        self.cell = cell

    def fault_line(self, offset):
        """The line in which the character at that offset of joined() lies."""
        for number, line in self.lines:
            if offset <= len(line):
                return number
            offset -= len(line) + 1
        return self.lines[-1][0]

    def joined(self):
        return " ".join(line for _, line in self.lines)


def paragraphs(lines, columns=False):
    """Texts of (number, line) pairs: divided by empty lines, items of lists, tables, fences and drawings. With `columns`, as in
    a comment, a line with gaps or arrows in it is a drawing, too."""
    text = Text()
    fenced = made = False
    before_empty = True
    for number, line in lines:
        stripped = line.strip()
        if stripped.startswith(("```", "~~~")):
            fenced = not fenced
            stripped = ""
        made = stripped != END_OF_MADE and (made or bool(MADE.match(stripped)))
        if fenced or not stripped or stripped.startswith(("#", "<!--", "![", "@code", "[!")):
            if text.lines:
                yield text
            text = Text()
            before_empty = True
            heading = None if fenced or columns else re.match(r"#+ (.*)", stripped)
            if heading:
                text.lines = [(number, heading[1])]
                yield text
                text = Text()
            continue
        if (not text.lines and before_empty and re.match(r"    |\t", line)) or (columns and DRAWING.search(line)):
            if text.lines:
                yield text
            text = Text()
            continue
        before_empty = False
        if stripped.startswith("|"):
            if text.lines:
                yield text
            for cell in re.split(r"(?<!\\)\|", stripped.strip("|")):
                if not re.fullmatch(r"[\s:-]*", cell):
                    text = Text(cell=not made)
                    text.lines = [(number, cell.strip())]
                    yield text
            text = Text()
            continue
        if columns and TAG.match(stripped):
            if text.lines:
                yield text
            text = Text()
        item = ITEM.match(stripped)
        if item and (text.lines == [] or not text.lines[-1][1].endswith((" the", " of"))):
            if text.lines:
                yield text
            text = Text()
            stripped = stripped[item.end():]
        text.lines.append((number, stripped))
    if text.lines:
        yield text


def documents(source):
    return paragraphs(enumerate(source.split("\n"), 1))


def c_texts(source):
    """(kind, text) of a file in C, C++ or IDL."""
    comment, last, message = [], None, None  # `last`: line and column of the comment before
    number, at = 1, 0
    for token in C_TOKEN.finditer(source):
        between = source[at:token.start()]
        number += between.count("\n")
        start = number
        number += token.group().count("\n")
        at = token.end()
        if token["line"] is not None:
            own = source.rfind("\n", 0, token.start()) + 1
            alone = not source[own:token.start()].strip()
            follows = alone and last == (start - 1, token.start() - own)
            if not follows:
                yield from (("comment", text) for text in paragraphs(comment, True))
                comment = []
            line = re.sub(r"^[/!]?<?(?: |$)", "", token["line"])
            comment.append((start, line))
            last = (start, token.start() - own)
        elif token["block"] is not None:
            lines = [(start + i, re.sub(r"^\s*\*+ ?", "", line)) for i, line in enumerate(token["block"].split("\n"))]
            yield from (("comment", text) for text in paragraphs(lines, True))
        elif token["text"] is not None:
            if message is not None and not between.strip():
                message.lines[0] = (message.lines[0][0], message.lines[0][1] + token["text"])
            else:
                if message is not None:
                    yield "message", message
                message = Text()
                message.lines = [(start, token["text"])]
        elif token["raw"] is not None:
            continue
    if message is not None:
        yield "message", message
    yield from (("comment", text) for text in paragraphs(comment, True))


def hash_texts(source):
    """(kind, text) of a file whose comments begin with #: a shell script, CMake."""
    comment, last = [], 0
    for number, line in enumerate(source.split("\n"), 1):
        for said in re.finditer(r"\b(?:echo|fail|fault|printf|say) (['\"])(.*?)\1", line):
            text = Text()
            text.lines = [(number, said[2])]
            yield "message", text
        found = re.search(r"(?:^|\s)#(?!!)+ ?(.*)$", line)
        if not found or (found.start() > 0 and line[:found.start()].count('"') % 2):
            continue
        if comment and (last != number - 1 or line[:found.start()].strip()):
            yield from (("comment", text) for text in paragraphs(comment, True))
            comment = []
        comment.append((number, found[1]))
        last = number
    yield from (("comment", text) for text in paragraphs(comment, True))


def of_line(source, offset, words):
    text = Text()
    text.lines = [(source.count("\n", 0, offset) + 1, words)]
    return text


def cmake_texts(source):
    yield from hash_texts(source)
    for token in CMAKE_TOKEN.finditer(source):
        if token[1] is not None:
            yield "message", of_line(source, token.start(), token[1])


def picture_texts(source):
    for found in PICTURE_TEXT.finditer(source):
        yield "picture", of_line(source, found.start(), html.unescape(re.sub(r"<[^>]*>", "", found[2])))


def python_texts(source):
    comment, last = [], 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT:
            continue
        number = token.start[0]
        if comment and (last != number - 1 or token.line[:token.start[1]].strip()):
            yield from (("comment", text) for text in paragraphs(comment, True))
            comment = []
        comment.append((number, re.sub(r"^#+!? ?", "", token.string)))
        last = number
    yield from (("comment", text) for text in paragraphs(comment, True))
    tree = ast.parse(source)
    docstrings = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant) \
                and isinstance(body[0].value.value, str):
            docstrings.add(body[0].value)
            lines = [(body[0].lineno + i, line) for i, line in enumerate(body[0].value.value.split("\n"))]
            yield from (("comment", text) for text in paragraphs(lines, True))
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in docstrings:
            text = Text()
            text.lines = [(node.lineno, node.value)]
            yield "message", text


def texts_of(name, source):
    if name.endswith(".md"):
        return (("cell" if text.cell else "document", text) for text in documents(source))
    if name.endswith(C_FILES):
        return c_texts(source)
    if name.endswith(".py"):
        return python_texts(source)
    if name.endswith(".svg"):
        return picture_texts(source)
    if name.endswith(CMAKE_FILES):
        return cmake_texts(source)
    return hash_texts(source)


def imperatives(source):
    """(line, literal) of each error whose text begins with an imperative."""
    for call in ERROR_CALL.finditer(source):
        depth = 1
        for part in CALL_PART.finditer(source, call.end()):
            depth += (part.group() == "(") - (part.group() == ")")
            if not depth or part.group()[0] == '"':
                if IMPERATIVE.match(part.group()):
                    yield source.count("\n", 0, part.start()) + 1, part.group()
                break


def plain(text):
    """Code as one word, links as their text, nothing of emphasis."""
    text = re.sub(r"`+[^`]*`+", CODE, text)
    text = re.sub(r"\]\([^)\s]*\)", "]", text)
    return text.replace("**", "").replace("__", "")


def is_message(text):
    """Has three words with letters, and is no line of a program or of a format."""
    return len(re.findall(r"(?:^|(?<=\s))[A-Za-z][a-z'-]+(?=[\s.,:;!?]|$)", text)) >= 3


def faults_of(kind, text, forbidden):
    """(offset in the text, fault)"""
    cell_words = len(WORD.findall(text)) if kind == "cell" else 0
    if cell_words > CELL_WORDS:
        yield 0, f"{cell_words} words in a cell, at most {CELL_WORDS}: {text[:50]}"
    for sentence in END_OF_SENTENCE.split(text):
        parts = [part for part in PART.split(sentence) if part]
        for part in parts:
            opening = OPENING.match(part)
            if opening and not sentence.rstrip("\"')]* ").endswith("?"):
                yield text.find(part), f"begins with '{opening[1]}': {part[:50]}"
        for found in WITHIN.finditer(sentence):
            yield text.find(sentence) + found.start(), f"a clause begins with '{found[0]}'"
        for found in OBJECT.finditer(sentence) if kind != "comment" else ():
            yield text.find(sentence) + found.start(), f"a noun instead of '{sentence[found.start():][:30]}'"
        if kind == "comment" and FOR_GENERATORS.match(sentence):
            continue
        words = len(WORD.findall(sentence))
        if words > WORDS and not (kind == "message" and NO_PROSE.search(sentence)):
            yield text.find(sentence), f"{words} words in a sentence, at most {WORDS}: {sentence[:50]}"
    for found in forbidden.finditer(text) if forbidden else ():
        yield found.start(), f"'{found[0]}' is not a word of {GLOSSARY}"


def forbidden_words(root):
    """The words of the column "not" of the glossary as one expression, or None."""
    words = []
    if (root / GLOSSARY).exists():
        for line in (root / GLOSSARY).read_text(encoding="utf-8").split("\n"):
            cells = [cell.strip() for cell in line.strip("|").split("|")] if line.startswith("|") else []
            if len(cells) == 3 and cells[2] not in ("", "not", "-") and not cells[2].startswith("--"):
                words += [word.strip() for word in cells[2].split(",")]
    forms = "|".join(map(re.escape, words))
    # A last consonant is doubled before -ed: swapped.
    return re.compile(rf"(?<![\w-])(?:{forms})(?:e?s|(?:\w?e)?d|\w?ing)?(?![\w-])", re.IGNORECASE) if words else None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("root", nargs="?", type=Path, default=Path(__file__).resolve().parents[2])
    options = parser.parse_args()
    names = subprocess.run(["git", "ls-files", "-z"], cwd=options.root, check=True, capture_output=True,
                           text=True).stdout.split("\0")
    forbidden = forbidden_words(options.root)
    wrong = read = 0
    for name in names:
        if not name.endswith((".md", ".py", ".svg", *C_FILES, *HASH_FILES)) or not (options.root / name).is_file():
            continue
        source = (options.root / name).read_text(encoding="utf-8")
        for line, literal in imperatives(source) if name.endswith(C_FILES) and not name.startswith("tests/") else ():
            print(f"{name}:{line}: an error begins with an imperative: {literal}")
            wrong += 1
        for kind, text in texts_of(name, source):
            joined = text.joined()
            read += 1
            if kind == "message" and not is_message(joined):
                continue
            shown = plain(joined)
            words = None if name == GLOSSARY else forbidden
            for offset, fault in faults_of(kind, shown, words):
                print(f"{name}:{text.fault_line(joined.find(shown[offset:offset + 20].split(CODE)[0]))}: {fault}")
                wrong += 1
    if not read:
        print("no text was found: is this a git checkout of the project?")
    return 1 if wrong or not read else 0


if __name__ == "__main__":
    sys.exit(main())
