#include "instances/runtime/memory/output_registers.hpp"

#include <algorithm>
#include <array>
#include <ranges>
#include <utility>

namespace plchost {

OutputRegisters::OutputRegisters(std::span<std::byte> registers, std::vector<ByteRange> ranges,
                                 std::span<const std::byte> initial, std::vector<std::byte> safe)
    : registers_(registers), ranges_(std::move(ranges)), safe_(std::move(safe)), changed_(registers.size()) {
  for (std::size_t at = 0; at < changed_.size(); ++at)
    changed_[at].store(initial[at], std::memory_order_relaxed);
}

void OutputRegisters::restore(ByteRange range) noexcept {
  const std::size_t end = range.offset + range.bytes;
  for (std::size_t at = range.offset; at < end;) {
    const std::size_t next = std::min(end, at - at % kPart + kPart);
    restore_part({.offset = at, .bytes = next - at});
    at = next;
  }
}

// Another task may note a value and write it meanwhile: that one stays. It does so once a cycle.
void OutputRegisters::restore_part(ByteRange range) noexcept {
  std::array<std::byte, kPart> values{};
  const std::span part = std::span(values).first(range.bytes);
  const auto is_noted = [&](std::size_t i) {
    return changed_[range.offset + i].load(std::memory_order_relaxed) == part[i];
  };
  bool is_last = false;
  while (!is_last) {
    for (std::size_t i = 0; i < range.bytes; ++i)
      part[i] = changed_[range.offset + i].load(std::memory_order_relaxed);
    write(range.offset, part);
    publish();
    is_last = std::ranges::all_of(std::views::iota(std::size_t{0}, range.bytes), is_noted);
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
