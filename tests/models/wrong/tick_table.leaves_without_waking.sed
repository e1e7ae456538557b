# schedulers/tick/tick_table.cpp: a task that leaves although the tick has claimed it wakes nobody
# caught as: asleep for ever: nobody wakes the sleeper
s/gate_\.pass\(table_\.clock_\);\n *wake_next\(\);/gate_.pass(table_.clock_);/
