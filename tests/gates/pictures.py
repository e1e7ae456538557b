#!/usr/bin/env python3
"""Each picture of the tree (SVG) can be read with every usual font, also on a dark page and without colours.

Usage: pictures.py [ROOT] (a git checkout); prints each fault. For each file that git knows:

* A rectangle that is not transparent lies behind everything.
* Fonts: the list ends with sans-serif. The width of a text is estimated in DejaVu Sans, the widest of the usual ones.
* Each text lies inside of the picture, and inside or outside of each box, with a margin; no text lies on another one,
  on a line or on a curve.
* A box of the class "process" has an arrow: a path with a marker begins or ends at its edge. No end of an arrow is
  hidden by a box that is drawn after it.
* A picture with curves has a title for each of its two axes (class "axis"). Its legend has a mark of its own shape for each
* curve that looks like no other.
"""

import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

# Widths in thousandths of the font's size, from space to ~: DejaVu Sans, DejaVu Sans Bold.
PLAIN = """318 401 460 838 637 951 780 275 391 391 501 838 318 361 318 337 637 637 637 637 637 637 637 637 637 637 337 337
838 838 838 531 1001 685 687 699 771 632 576 775 752 295 295 656 558 863 749 788 604 788 695 635 611 732 685 989 686 611
686 391 337 391 838 501 501 613 635 550 635 616 353 635 634 278 278 580 278 975 634 612 635 635 412 521 393 634 592 818
592 592 525 637 337 637 838"""
BOLD = """349 457 521 838 696 1002 873 307 458 458 523 838 380 416 380 366 696 696 696 696 696 696 696 696 696 696 400 400
838 838 838 581 1001 774 763 734 831 684 684 821 837 373 373 775 638 996 837 851 733 851 771 721 683 813 774 1104 771 725
726 458 366 458 838 501 501 675 716 593 716 679 436 716 712 343 343 666 343 1042 712 688 716 716 494 596 479 712 652 924
646 652 583 712 366 712 838"""
WIDTHS = {False: [int(w) for w in PLAIN.split()], True: [int(w) for w in BOLD.split()]}
MARGIN = 3.0  # between a text and the edge of its box or picture


def width_of(text, size, bold):
    widths = WIDTHS[bold]
    return sum(widths[ord(c) - 32] if 32 <= ord(c) < 127 else 740 for c in text) * size / 1000


class Box:
    def __init__(self, left, top, right, bottom):
        self.left, self.top, self.right, self.bottom = left, top, right, bottom

    def grown(self, by):
        return Box(self.left - by, self.top - by, self.right + by, self.bottom + by)

    def meets(self, other):
        return (self.left < other.right and other.left < self.right
                and self.top < other.bottom and other.top < self.bottom)

    def holds(self, other):
        return (self.left <= other.left and other.right <= self.right
                and self.top <= other.top and other.bottom <= self.bottom)

    def meets_line(self, begin, end):
        """Whether a part of the line lies inside (Liang and Barsky)."""
        first, last = 0.0, 1.0
        for at, step, low, high in ((begin[0], end[0] - begin[0], self.left, self.right),
                                    (begin[1], end[1] - begin[1], self.top, self.bottom)):
            if step == 0:
                if not low < at < high:
                    return False
                continue
            one, other = (low - at) / step, (high - at) / step
            first, last = max(first, min(one, other)), min(last, max(one, other))
        return first < last


def styles_of(root):
    """Class -> {property: value}, of rules like `.name { a: b; c: d }`."""
    rules = {}
    for style in root.iter("style"):
        for names, body in re.findall(r"([^{}]+)\{([^}]*)\}", style.text or ""):
            for name in re.findall(r"\.([\w-]+)", names):
                pairs = (p.split(":", 1) for p in body.split(";") if ":" in p)
                rules.setdefault(name, {}).update({k.strip(): v.strip() for k, v in pairs})
    return rules


class Picture:
    def __init__(self, path):
        self.faults = []
        self.root = ElementTree.parse(path).getroot()
        for element in self.root.iter():
            element.tag = element.tag.rsplit("}", 1)[-1]
        self.rules = styles_of(self.root)
        parents = {child: parent for parent in self.root.iter() for child in parent}
        hidden = {e for name in ("defs", "marker") for outer in self.root.iter(name) for e in outer.iter()}
        self.elements = [e for e in self.root.iter() if e not in hidden]
        self.parents = parents
        view = [float(n) for n in self.root.get("viewBox", "0 0 0 0").split()]
        self.view = Box(view[0], view[1], view[0] + view[2], view[1] + view[3])

    def fault(self, text):
        self.faults.append(text)

    def value(self, element, name, default=""):
        """An attribute or a property, its own or inherited."""
        while element is not None:
            for rule in element.get("class", "").split():
                if name in self.rules.get(rule, {}):
                    return self.rules[rule][name]
            if element.get(name):
                return element.get(name)
            element = self.parents.get(element)
        return default

    def all(self, tag):
        return [e for e in self.elements if e.tag == tag]

    def rectangle(self, element):
        x, y = float(element.get("x", 0)), float(element.get("y", 0))
        return Box(x, y, x + float(element.get("width")), y + float(element.get("height")))

    def text_box(self, element):
        size = float(self.value(element, "font-size", "16").removesuffix("px"))
        words = "".join(element.itertext())
        width = width_of(words, size, self.value(element, "font-weight") == "bold")
        x, y = float(element.get("x", 0)), float(element.get("y", 0))
        left = x - width * {"start": 0, "middle": 0.5, "end": 1}[self.value(element, "text-anchor", "start")]
        box = Box(left, y - 0.76 * size, left + width, y + 0.24 * size)
        turned = element.get("transform")
        if not turned:
            return box
        around = re.fullmatch(r"rotate\(-90 ([\d.]+) ([\d.]+)\)", turned)
        if not around:
            self.fault(f"'{words}' is turned in another way than rotate(-90 x y)")
            return box
        cx, cy = map(float, around.groups())
        return Box(cx + box.top - cy, cy - (box.right - cx), cx + box.bottom - cy, cy - (box.left - cx))

    def lines_of(self, element):
        if element.tag == "line":
            points = [tuple(float(element.get(f"{c}{i}")) for c in "xy") for i in (1, 2)]
        elif element.tag == "polyline":
            points = [tuple(map(float, p.split(","))) for p in element.get("points").split()]
        elif re.fullmatch(r"[ML\d., -]+", element.get("d", "")):
            points = [tuple(map(float, p)) for p in re.findall(r"([-\d.]+)[, ]([-\d.]+)", element.get("d"))]
        else:
            points = []
        return list(zip(points, points[1:]))

    def check_background(self):
        first = next((e for e in self.elements if e.tag in ("rect", "text", "line", "path", "polyline")), None)
        if first is None or first.tag != "rect" or not self.rectangle(first).holds(self.view) or \
                not self.value(first, "fill").startswith("#"):
            self.fault("no rectangle of a colour lies behind everything: on a dark page it cannot be read")
            return None
        return first

    def check_texts(self, background):
        texts = [(" ".join("".join(e.itertext()).split()), self.text_box(e)) for e in self.all("text")]
        boxes = [self.rectangle(e) for e in self.all("rect") if e is not background]
        lines = [pair for tag in ("line", "polyline", "path") for e in self.all(tag) for pair in self.lines_of(e)]
        for i, (words, box) in enumerate(texts):
            if not self.view.holds(box.grown(MARGIN)):
                self.fault(f"'{words}' does not fit into the picture")
            for other in boxes:
                if other.meets(box.grown(MARGIN)) and not other.holds(box.grown(MARGIN)):
                    self.fault(f"'{words}' crosses the edge of a box")
            for other_words, other in texts[i + 1:]:
                if box.meets(other):
                    self.fault(f"'{words}' and '{other_words}' lie on each other")
            if any(box.meets_line(*line) for line in lines):
                self.fault(f"a line crosses '{words}'")

    def check_fonts(self):
        for element in self.elements:
            for family in (element.get("font-family"), *(r.get("font-family") for r in self.rules.values())):
                if family and not family.rstrip("; ").endswith("sans-serif"):
                    self.fault(f"the fonts '{family}' do not end with sans-serif")
        if self.all("text") and not all(self.value(e, "font-family") for e in self.all("text")):
            self.fault("a text without a list of fonts")

    def arrows(self):
        """Each path with a marker, with its two ends."""
        for path in self.all("path"):
            properties = [*path.keys(), *(k for c in path.get("class", "").split() for k in self.rules.get(c, {}))]
            pieces = self.lines_of(path)
            if pieces and any(name.startswith("marker") for name in properties):
                yield path, (pieces[0][0], pieces[-1][1])

    def check_processes(self):
        ends = []
        for path, both in self.arrows():
            ends += both
            for element in self.elements[self.elements.index(path):]:
                box = self.rectangle(element).grown(-1) if element.tag == "rect" else None
                if box and any(box.left < x < box.right and box.top < y < box.bottom for x, y in both):
                    self.fault(f"a box hides an end of the arrow {path.get('d')}")
        for element in self.all("rect"):
            if "process" not in element.get("class", "").split():
                continue
            box = self.rectangle(element)
            inner, outer = box.grown(-6), box.grown(6)
            if not any(outer.left <= x <= outer.right and outer.top <= y <= outer.bottom
                       and not (inner.left < x < inner.right and inner.top < y < inner.bottom) for x, y in ends):
                self.fault(f"the process at {box.left:g},{box.top:g} has no arrow")

    def check_curves(self):
        curves = self.all("polyline")
        if not curves:
            return
        axes = [e for e in self.all("text") if "axis" in e.get("class", "").split() and (e.text or "").strip()]
        if sorted("transform" in e.keys() for e in axes) != [False, True]:
            self.fault("an axis has no title")
        looks = {(e.get("stroke"), e.get("stroke-dasharray")) for e in curves}
        legend = [e for e in self.all("text") if "legend" in e.get("class", "").split()]
        lower = max(y for e in curves for _, (_, y) in self.lines_of(e))
        shapes = {(e.get("d").split(" ", 1)[1], e.get("fill") == "#ffffff") for e in self.all("path")
                  if "mark" in e.get("class", "").split() and self.lowest(e) > lower}
        if len(legend) != len(looks) or len(shapes) != len(looks):
            self.fault(f"{len(looks)} kinds of curves, {len(legend)} lines of legend, {len(shapes)} shapes of marks there")

    @staticmethod
    def lowest(mark):
        return float(re.match(r"M[-\d.]+,([-\d.]+)", mark.get("d")).group(1))

    def check(self):
        self.check_texts(self.check_background())
        self.check_fonts()
        self.check_processes()
        self.check_curves()
        return self.faults


def main():
    root = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parents[2])
    names = subprocess.run(["git", "-C", root, "ls-files", "*.svg"], check=True, capture_output=True, text=True).stdout
    wrong = 0
    for name in names.split():
        for fault in Picture(root / name).check():
            print(f"{name}: {fault}")
            wrong = 1
    return wrong


if __name__ == "__main__":
    sys.exit(main())
