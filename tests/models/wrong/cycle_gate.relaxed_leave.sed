# schedulers/task/cycle_gate.hpp: what a cycle has written is not there when its seat is empty
s/void leave\(\) noexcept \{ taken_\.store\(false, std::memory_order_release\); \}/void leave() noexcept { taken_.store(false, std::memory_order_relaxed); }/
