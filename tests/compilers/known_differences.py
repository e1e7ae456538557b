"""Where a compiler itself refuses a source of STruC++'s suite, or makes another value of it: the name of the source, and the reason."""

REFUSED_BY_MATIEC = {
    **dict.fromkeys(("fb_deep_method", "fb_methods", "fb_method_collision", "fb_this_super"), "third edition: methods"),
    "fb_abstract": "third edition: `ABSTRACT`",
    "fb_final": "third edition: `FINAL`",
    "fb_inheritance": "third edition: `EXTENDS`",
    "fb_interfaces": "third edition: interfaces",
    "fb_properties": "third edition: properties",
    "enums": "third edition: `MachineState : INT (IDLE := 0, ...)`",
    "enum_dot_notation": "third edition: `TrafficState.RED`",
    "string_conversions": "`WSTRING`",
    "strings": "`''` in a text; MATIEC wants `$'`",
    "time_types": "`TIME_TO_US`, `TO_LINT` are no functions of MATIEC",
    "oscat_string": "`STRING(254)`; MATIEC wants `STRING[254]`",
    "fb_composition": "`sensor : Sensor`: a name of a type",
    "oscat_control": "`R_EDGE` is a word of the language",
    "oscat_fb": "`STEP` is a word of charts",
    "pid_controller": "`dt` is a word, `integral` a name of its library",
    "oscat_convert": "`EXPT` of an `INT`",
    "oscat_encoding": "`DINT := INT`",
    **dict.fromkeys(("bistable", "counters", "edge_detection", "timers", "initialization", "type_defaults"), "a `PROGRAM` without a statement"),
}
# Sources that STruC++ takes, and its runner does not.
WITHOUT_RUNNER = {"constants": "C++ that does not compile"}
# Sources that MATIEC takes, and their TEST blocks it does not.
STATEMENTS_REFUSED_BY_MATIEC = {"enum_bare_members": "third edition: `TrafficState.RED`"}
# TEST blocks of which a statement does not hold with MATIEC.
STATED_OTHERWISE = {
    "counters": {"CTUD counts up and down independently": "`CD` counts rising edges"},
    "edge_detection": {"F_TRIG detects falling edges": "an edge in the first cycle"},
}
# Variables that have another value with MATIEC.
OTHER_VALUES = {
    "for_loop": ("run0.i", "run0.j"),
    "nested_loops": ("run0.i",),
    "arrays": ("run0.i",),
    "multidim_arrays": ("run0.i", "run0.j"),
}
