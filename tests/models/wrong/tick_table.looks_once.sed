# schedulers/tick/tick_table.cpp: a task states for when it waits without looking again whether the tick has passed
# caught as: asleep for ever: nobody wakes the sleeper
s/const bool passed = table_\.last_tick_\.load\(\) >= release;/const bool passed = false;/
