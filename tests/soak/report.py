"""The report of a soak: series over time, their slopes with a bound, and plots of them (SVG)."""

import html

WIDTH, HEIGHT = 760, 220
LEFT, RIGHT, TOP, BOTTOM = 80, 150, 30, 30
COLOURS = ["#1f5fa8", "#c4501b", "#2f8f4e", "#7b4ab0", "#8a6d1c", "#444444"]
WARM_UP = 0.25  # of the samples, which do not count: all caches fill in that time
TELLING = 240  # s of samples that tell a growth from the size of a process that was just started


def slope(points):
    """Least squares, per second; 0 of less than two moments."""
    if len(points) < 2:
        return 0.0
    middle = sum(at for at, _ in points) / len(points)
    mean = sum(value for _, value in points) / len(points)
    spread = sum((at - middle) ** 2 for at, _ in points)
    return sum((at - middle) * (value - mean) for at, value in points) / spread if spread else 0.0


class Series:
    """A resource over time. It is flat if the line through its samples rises by no more than `bound` from their begin to their end.
    `least` is the least bound; infinite: it is a figure that nobody judges."""

    def __init__(self, group, name, unit, least):
        self.group, self.name, self.unit, self.least = group, name, unit, least
        self.points = []

    def add(self, at, value):
        self.points.append((at, value))

    def settled(self):
        return self.points[int(len(self.points) * WARM_UP):]

    def growth(self):
        points = self.settled()
        return slope(points) * (points[-1][0] - points[0][0]) if points else 0.0

    def bound(self):
        """A tenth of what there is, or `least` where that is more."""
        points = self.settled()
        return max(self.least, 0.1 * sum(value for _, value in points) / len(points)) if points else self.least

    def per_hour(self):
        return slope(self.settled()) * 3600

    def is_long(self):
        points = self.settled()
        return bool(points) and points[-1][0] - points[0][0] >= TELLING

    def is_flat(self):
        return not self.is_long() or self.growth() <= self.bound()


def nice(value):
    return f"{value:,.0f}" if abs(value) >= 100 or value == int(value) else f"{value:,.2f}"


def plot(title, unit, series, marks=()):
    """A picture of the series over minutes. `marks`: name and times of events, as short lines at the bottom."""
    points = [point for one in series for point in one.points]
    last = max((at for at, _ in points), default=1) or 1
    greatest = max((value for _, value in points), default=1) or 1

    def x(at):
        return LEFT + (WIDTH - LEFT - RIGHT) * at / last

    def y(value):
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * value / greatest
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="11">',
             f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>', f'<text x="{LEFT}" y="16" font-size="13">{html.escape(title)} ({html.escape(unit)})</text>']
    for part in (0, 0.5, 1):
        parts.append(f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(part * greatest):.1f}" y2="{y(part * greatest):.1f}" stroke="#dddddd"/>'
                     f'<text x="{LEFT - 6}" y="{y(part * greatest) + 4:.1f}" text-anchor="end">{nice(part * greatest)}</text>'
                     f'<text x="{x(part * last):.1f}" y="{HEIGHT - 8}" text-anchor="middle">{nice(part * last / 60)} min</text>')
    for number, one in enumerate(series):
        colour = COLOURS[number % len(COLOURS)]
        line = " ".join(f"{x(at):.1f},{y(value):.1f}" for at, value in one.points)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.4"/>'
                     f'<text x="{WIDTH - RIGHT + 8}" y="{TOP + 10 + 16 * number}" fill="{colour}">{html.escape(one.name)}</text>')
    for number, (name, times) in enumerate(marks):
        colour, row = COLOURS[(len(series) + number) % len(COLOURS)], HEIGHT - BOTTOM - 5 * number
        parts += [f'<line x1="{x(at):.1f}" x2="{x(at):.1f}" y1="{row - 4}" y2="{row}" stroke="{colour}"/>' for at in times]
        parts.append(f'<text x="{WIDTH - RIGHT + 8}" y="{TOP + 10 + 16 * (len(series) + number)}" fill="{colour}">{html.escape(name)}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


def table(heads, rows):
    return "\n".join(["| " + " | ".join(heads) + " |", "| " + " | ".join("---" for _ in heads) + " |",
                      *("| " + " | ".join(row) + " |" for row in rows)])


def write(folder, summary, series, counts, failures, marks):
    """report.md, and a picture for each group of series."""
    folder.mkdir(parents=True, exist_ok=True)
    groups = {}
    for one in series:
        groups.setdefault(one.group, []).append(one)
    lines = ["# Soak", "", *summary, ""]
    lines += ["## Invariants", ""]
    lines += [f"* {what}" for what in failures] or ["Each held all along."]
    lines += ["", "## Counts", "", table(["what", "count"], [[name, f"{count:,}"] for name, count in counts.items()]), "", "## Resources", "",
              "Growth: of the line through the samples after the first quarter, from its begin to its end. The bound is a tenth of their mean, or the "
              "least step that says anything.", "",
              table(["resource", "unit", "first", "last", "growth", "bound", "per hour", "flat"],
                    [[f"{one.group}: {one.name}", one.unit, nice(one.points[0][1]), nice(one.points[-1][1]), nice(one.growth()), nice(one.bound()),
                      nice(one.per_hour()), "NO" if not one.is_flat() else "yes" if one.is_long() else "too short to tell"] for one in series if one.points and one.least < float("inf")]), ""]
    for group, members in groups.items():
        file = group.replace(" ", "_") + ".svg"
        (folder / file).write_text(plot(group, members[0].unit, members, marks), encoding="utf-8")
        lines += [f"![{group}]({file})", ""]
    (folder / "report.md").write_text("\n".join(lines), encoding="utf-8")
