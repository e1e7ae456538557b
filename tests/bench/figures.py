#!/usr/bin/env python3
"""The figures of a run of the benchmark as Markdown: figures.py FIGURES.json > figures.md.

figures.py --renew FIGURES.json PART.json > NEW.json: the rows of a run of some parts take the place of those of the same name
and condition, or come after them. Each row has the conditions of its own run.
All tables of figures.md come from figures.json by this script. tests/gates/documents.py makes them anew and compares: it sees
a row that somebody has edited.
"""

import json
import statistics
import sys

UNITS = [("_us_per_cycle", "us"), ("_ns_per_cycle", "ns"), ("_us_per_activation", "us"), ("_us", "us"), ("_ms", "ms"), ("_ns", "ns"),
         ("gb_s", "GB/s"), ("_mib", "MiB"), ("_per_second", "per second"), ("_per_million", "per million"), ("_per_cycle", "per cycle"),
         ("_per_stall", "per stall"), ("_percent", "%"), ("_ppb", "ppb"), ("share_of_core", "share of a core"),
         ("load", "share of a core"), ("share", "share of a core")]
# The unit of the last ones stands before a number of tasks or objects.
INFIXES = [("_us_per_activation_", "us"), ("_ns_per_", "ns"), ("_us_", "us")]


def unit_of(key):
    """By the end of its name."""
    for end, unit in UNITS:
        if key.endswith(end):
            return unit
    for infix, unit in INFIXES:
        if infix in key:
            return unit
    return "count"


def text(value):
    """Four digits; "-" is what was not measured."""
    if value is None:
        return "-"
    if abs(value) >= 10000:
        return f"{value:,.0f}"
    return f"{value:.4g}"


def spread(values):
    """Of the rounds: the least and the most."""
    known = [value for value in values if value is not None]
    if not known:
        return "-"
    least, most = text(min(known)), text(max(known))
    return least if least == most else f"{least} to {most}"


def table(heads, lines):
    rows = [heads, ["---"] * len(heads), *lines]
    return ["| " + " | ".join(row) + " |" for row in rows] + [""]


def of_conditions(rows, key):
    return [value for row in rows for value in row["conditions"][key] if value is not None]


def usual(values, unit=""):
    """The median, and the least and the most."""
    return f"{text(statistics.median(values))}{unit} (median; {spread(values)}{unit})" if values else "-"


def others(rows):
    """For each condition: the load of other processes."""
    lines = []
    for condition in dict.fromkeys(row["condition"] for row in rows):
        those = [row for row in rows if row["condition"] == condition]
        lines += [f"* {condition}: other processes had {usual(of_conditions(those, 'other_cpu_percent'), ' %')} of the cores "
                  "while a part was measured.",
                  f"  The hypervisor took {usual(of_conditions(those, 'steal_percent'), ' %')}. The load average before was "
                  f"{usual(of_conditions(those, 'load_average'))}."]
    return lines


def others_in_short(rows):
    """The same in one line."""
    shares = {condition: [value for row in rows if row["condition"] == condition for value in row["conditions"]["other_cpu_percent"]
                          if value is not None] for condition in dict.fromkeys(row["condition"] for row in rows)}
    return "Other processes had, while a part was measured, of the cores: " + "; ".join(
        f"{condition} {statistics.median(values):.0f} % (median), at most {max(values):.0f} %" for condition, values in shares.items()) + "."


def each_with_its_parts(rows, line_of):
    """A line for each of the conditions that the rows have. If there are several, some parts were measured anew: it names them."""
    lines = {}
    for row in rows:
        parts = lines.setdefault(line_of(row["conditions"]), [])
        if (part := row["name"].split("/")[0]) not in parts:
            parts.append(part)
    if len(lines) == 1:
        return [f"{line}." for line in lines]
    return [f"{line}: {', '.join(f'`{part}`' for part in parts)}." for line, parts in lines.items()]


def conditions(rows):
    """Of the run: the machine, the revision, the rounds, and what else it did."""
    rounds = spread([row["rounds"] for row in rows])
    return [*each_with_its_parts(rows, lambda made: f"* Machine: {made['cores']} cores, {made['processor']}, kernel {made['kernel']}"),
            *each_with_its_parts(rows, lambda made: f"* Revision of the sources: {made.get('revision', 'unknown')}"),
            f"* {rounds} rounds of {spread(of_conditions(rows, 'each_s'))} s of each thing. A spread is the least and the most of "
            "the rounds.", *others(rows), ""]


def percentiles(rows):
    keys = ["p50_us", "p99_us", "p999_us"]
    names = ["p50", "p99", "p99.9"]
    heads = ["", "", *[f"{name} us" for name in names], *[f"floor {name} us" for name in names], "samples", "of the floor",
             "a sample is"]
    return table(heads, [[f"`{row['name']}`", row["condition"], *[text(row[key]) for key in keys],
                          *[text(row["floor_" + key]) for key in keys], text(row["samples"]), text(row["floor_samples"]),
                          row["sample"]] for row in rows])


def ratios(rows):
    keys = ["p50", "p99", "p999"]
    heads = ["", "", *[word for name in ("p50", "p99", "p99.9") for word in (f"{name}, all rounds", "spread")]]
    return table(heads, [[f"`{row['name']}`", row["condition"],
                          *[word for key in keys for word in (text(row["ratio_" + key]), spread(row[f"ratio_{key}_rounds"]))]]
                         for row in rows if row["floor_samples"]])


def targets(rows):
    heads = ["", "", "to show", "unit", "measured", "spread", "bound", "spread", "verdict"]
    lines = []
    for row in rows:
        for target in row.get("targets", []):
            verdict = target["verdict"]
            lines.append([f"`{row['name']}`", row["condition"], target["target"], target["unit"], text(target["measured"]),
                          spread(target["measured_rounds"]), text(target["bound"]), spread(target["bound_rounds"]),
                          verdict if verdict == "met" else f"**{verdict}**"])
    return table(heads, lines)


def further(rows):
    heads = ["", "", "figure", "unit", "median", "spread"]
    return table(heads, [[f"`{row['name']}`", row["condition"], key, unit_of(key), text(value), spread(row["extra_rounds"][key])]
                         for row in rows for key, value in row.get("extra", {}).items()])


def tables(rows):
    """The lines of the page, without its heading."""
    without = sorted({f"`{row['name']}`" for row in rows if not row["floor_samples"]})
    lines = ["", *conditions(rows), "## Times", "", *percentiles(rows), "## Ratios to the floor", "", *ratios(rows)]
    if without:
        lines += [f"Without times of a floor: {', '.join(without)}.", ""]
    lines += ["## Targets", "",
              "Measured and bound are the medians of the rounds. Each round decides for itself whether a target is met.", "",
              *targets(rows), "## Further figures", "", *further(rows)]
    notes = [f"* `{name}`: {note}" for name, note in
             dict((row["name"], row["note"]) for row in rows if row.get("note")).items()]
    return [*lines, "## Notes", "", *notes, ""] if notes else lines


def read(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def renewed(rows, part):
    """A line for each row, as the benchmark writes them."""
    newer = {(row["name"], row["condition"]): row for row in part}
    rows = [newer.pop((row["name"], row["condition"]), row) for row in rows] + list(newer.values())
    return "[\n" + ",\n".join(json.dumps(row, ensure_ascii=False, separators=(",", ":")) for row in rows) + "\n]"


def main():
    if sys.argv[1] == "--renew":
        print(renewed(read(sys.argv[2]), read(sys.argv[3])))
        return
    rows = read(sys.argv[1])
    print("# Figures", "",
          "The measurements, the method, and how to read the figures: [README](README.md). \"-\" says that nothing was measured, or",
          "that there are too few samples: p99 needs 100, p99.9 needs 1,000.", "",
          "<!-- generated: all-figures (tests/bench/figures.py figures.json) -->", *tables(rows), "<!-- end of generated -->", sep="\n")


if __name__ == "__main__":
    main()
