#include "instances/runtime/memory/output_registers.hpp"

#include <utility>

namespace plchost {

OutputRegisters::OutputRegisters(std::span<std::byte> registers, std::vector<ByteRange> ranges,
                                 std::span<const std::byte> initial, std::vector<std::byte> safe)
    : registers_(registers),
      ranges_(std::move(ranges)),
      safe_(std::move(safe)),
      changed_(keeps() ? 0 : registers.size()) {
  for (std::size_t at = 0; at < changed_.size(); ++at)
    changed_[at].store(initial[at], std::memory_order_relaxed);
}

void OutputRegisters::change(std::size_t at, std::byte value) noexcept {
  if (!keeps()) changed_[at].store(value, std::memory_order_relaxed);
  if (!off()) write(at, std::span(&value, 1));
}

void OutputRegisters::restore(ByteRange range) noexcept {
  if (keeps()) return;
  for (std::size_t at = range.offset; at < range.offset + range.bytes; ++at) {
    const std::byte value = changed_[at].load(std::memory_order_relaxed);
    write(at, std::span(&value, 1));
  }
}

void OutputRegisters::put_safe() noexcept {
  off_.store(true, std::memory_order_seq_cst);
  put_safe(ranges_);
}

void OutputRegisters::put_safe(std::span<const ByteRange> ranges) noexcept {
  if (keeps()) return;
  for (const ByteRange range : ranges)
    write(range.offset, std::span<const std::byte>(safe_).subspan(range.offset, range.bytes));
}

}  // namespace plchost
