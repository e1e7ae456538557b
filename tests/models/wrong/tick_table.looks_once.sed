# schedulers/tick/tick_table.cpp: a task states for when it waits without looking again whether the tick has passed
s/const bool passed = table_\.last_tick_\.load\(\) >= release;/const bool passed = false;/
