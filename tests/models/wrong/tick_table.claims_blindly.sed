# schedulers/tick/tick_table.cpp: the tick takes a task that has left meanwhile
# caught as: asleep for ever: nobody wakes the sleeper
s/if \(slot\.due\.compare_exchange_strong\(due, kClaimed\)\) due_\.push_back/if (slot.due.store(kClaimed), due >= 0) due_.push_back/
