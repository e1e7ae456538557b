# schedulers/faults/cycle_gate.hpp: the writes of a cycle are not there when its seat is empty
# caught as: a data race: a read of memory
s/void leave\(\) noexcept \{ word_\.store\(kOutside, std::memory_order_release\); \}/void leave() noexcept { word_.store(kOutside, std::memory_order_relaxed); }/
