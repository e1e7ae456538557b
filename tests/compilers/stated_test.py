#!/usr/bin/env python3
"""stated.py and the comparisons of proof.py, without a compiler."""

import sys
import unittest

sys.dont_write_bytecode = True
from instance_of_proof import values_of
from proof import compare
from stated import blocks_of, program_of

TESTS = """(* don't run TEST 'none' *)
TEST 'it''s a timer'
  VAR t, a : TON; x : STRING := 'a;b'; END_VAR
  t(IN := TRUE, a := a.Q, PT := T#30ms);  // a comment
  ADVANCE_TIME(T#20ms);
  ASSERT_EQ(x, 'it, ;x', 'a message');
  ASSERT_NEAR(t.x, -0.5, 0.1);
  ASSERT_FALSE(t.Q);
END_TEST
TEST 'two' ASSERT_NEQ(Double(a := 1), 16#a); END_TEST
"""
SOURCE = "PROGRAM Dummy END_PROGRAM\nPROGRAM Plain\n  VAR n : INT; END_VAR\n\nEND_PROGRAM\nPROGRAM Full\n  n := 1;\nEND_PROGRAM\n"


class Stated(unittest.TestCase):
    def test_blocks_become_programs(self):
        timer, two = blocks_of(TESTS)
        self.assertEqual((timer.name, timer.cycles, two.name, two.cycles), ("it''s a timer", 3, "two", 1))
        self.assertEqual([counter for counter, _ in timer.counters], ["stated0i.held0", "stated0i.held1", "stated0i.held2"])
        text = timer.text()
        for expected in ("IF cycle = 1 THEN\n  its_t(IN := TRUE, a := its_a.Q, PT := T#30ms);\nEND_IF;\nIF cycle = 3 THEN\n", "its_x :  STRING := 'a;b';",
                         "IF (its_x) = ('it, ;x') THEN held0", "IF ABS((its_t.x) - (-0.5)) <= (0.1) THEN held1", "IF (its_t.Q) THEN held2 := -1000000; ELSE held2 := held2 + 1;"):
            self.assertIn(expected, text)
        self.assertIn("IF (Double(a := 1)) <> (16#a) THEN held0", two.text())

    def test_times_between_two_cycles_are_refused(self):
        with self.assertRaises(ValueError):
            blocks_of("TEST 'x' ADVANCE_TIME(T#15ms); END_TEST")

    def test_programs_become_function_blocks(self):
        text = program_of(SOURCE, [])
        self.assertNotIn("Dummy", text)
        self.assertNotIn("PROGRAM", text)
        self.assertIn("FUNCTION_BLOCK Plain\n  VAR n : INT; END_VAR\n\nVAR a_body : BOOL; END_VAR\na_body := TRUE;\nEND_FUNCTION_BLOCK", text)
        self.assertIn("FUNCTION_BLOCK Full\n  n := 1;\nEND_FUNCTION_BLOCK", text)


class Compared(unittest.TestCase):
    def test_a_difference_is_found_in_its_cycle(self):
        count, different = compare([{"a": [1], "b": [1.0, 2.0]}, {"a": [2], "b": [1.0, 2.0]}], [{"a": [1], "b": [1.0, 2.0]}, {"a": [3], "c": [1]}])
        self.assertEqual((count, different), (3, {"a": "a is 2, not 3 (cycle 2)"}))

    def test_cycles_that_were_not_seen_are_left_out(self):
        self.assertEqual(compare([{"a": [1]}, {"a": [2]}], [{"a": [1]}, {"a": [3]}], [4, 7])[1], {"a": "a is 2, not 3 (cycle 7)"})

    def test_values_of_plcctl_are_read(self):
        self.assertEqual(values_of("[TRUE, -2, 16#00FF, 1.5]"), [True, -2, 255, 1.5])
        self.assertEqual(values_of("[[1, 2], [3, 4]]"), [1, 2, 3, 4])
        self.assertEqual(values_of("'it$'s, $41$N'"), ["it's, A\n"])
        self.assertEqual(values_of("T#5ms"), [None])


if __name__ == "__main__":
    unittest.main()
