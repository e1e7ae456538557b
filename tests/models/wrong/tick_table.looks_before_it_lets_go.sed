# schedulers/tick/tick_table.cpp: the state of a task between the tick's look and the end of its place on the list is forgotten
# caught as: asleep for ever: nobody wakes the sleeper
s/slot->handed_in\.exchange\(false\);\n    const Duration::rep due = slot->due\.load\(\);/const Duration::rep due = slot->due.load();\n    slot->handed_in.exchange(false);/
