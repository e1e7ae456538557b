#include "instances/runtime/memory/task_areas.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace plchost {

namespace {

constexpr std::size_t kWord = sizeof(std::uint32_t);

bool is_aligned(const void* address) noexcept {
  return reinterpret_cast<std::uintptr_t>(address) % kWord == 0;
}

// Registers have effects when they are touched: each access is made as it is written here.
void read_word(std::byte* to, const std::byte* from) noexcept {
  const std::uint32_t word = *reinterpret_cast<const volatile std::uint32_t*>(from);
  std::memcpy(to, &word, kWord);
}
void write_word(std::byte* to, const std::byte* from) noexcept {
  std::uint32_t word = 0;
  std::memcpy(&word, from, kWord);
  *reinterpret_cast<volatile std::uint32_t*>(to) = word;
}
void read_byte(std::byte* to, const std::byte* from) noexcept {
  *to = *const_cast<const volatile std::byte*>(from);
}
void write_byte(std::byte* to, const std::byte* from) noexcept {
  *const_cast<volatile std::byte*>(to) = *from;
}

template <class Word, class Byte>
void copy_aligned(std::byte* to, const std::byte* from, std::size_t bytes, const void* registers,
                  const Word& word, const Byte& byte) noexcept {
  std::size_t at = 0;
  const auto begin = static_cast<const std::byte*>(registers);
  while (at < bytes && !is_aligned(begin + at)) {
    byte(to + at, from + at);
    ++at;
  }
  for (; at + kWord <= bytes; at += kWord) word(to + at, from + at);
  for (; at < bytes; ++at) byte(to + at, from + at);
}

std::span<std::byte> part(std::span<std::byte> all, ByteRange range) noexcept {
  return all.subspan(range.offset, range.bytes);
}

}  // namespace

void copy_from_registers(std::span<std::byte> to, std::span<const std::byte> registers) noexcept {
  copy_aligned(to.data(), registers.data(), to.size(), registers.data(), read_word, read_byte);
}

void copy_to_registers(std::span<std::byte> registers, std::span<const std::byte> from) noexcept {
  copy_aligned(registers.data(), from.data(), from.size(), registers.data(), write_word, write_byte);
}

InputView::InputView(std::vector<std::byte> initial, const plc_image* source)
    : bytes_(std::move(initial)), scratch_(bytes_.size()), image_(source) {}

InputView::InputView(std::vector<std::byte> initial, std::span<const std::byte> registers)
    : bytes_(std::move(initial)), registers_(registers) {}

void InputView::begin_cycle() noexcept {
  if (image_ == nullptr) {
    if (!registers_.empty()) copy_from_registers(bytes_, registers_);
    return;
  }
  const int got = plc_image_read(image_, scratch_.data(), nullptr);
  if (got == PLC_IMAGE_OK) {
    std::memcpy(bytes_.data(), scratch_.data(), bytes_.size());
  } else if (got == PLC_IMAGE_BUSY) {
    missed_.store(missed() + 1, std::memory_order_relaxed);
  }
}

OutputView::OutputView(std::vector<std::byte> initial, Writes writes, OutputImage* image)
    : bytes_(std::move(initial)),
      base_(bytes_),
      scratch_(bytes_.size()),
      writes_(std::move(writes)),
      image_(image) {}

OutputView::OutputView(std::vector<std::byte> initial, Writes writes, std::span<std::byte> registers)
    : bytes_(std::move(initial)), base_(bytes_), writes_(std::move(writes)), registers_(registers) {}

// All but its own bytes, of which it knows more than anybody.
void OutputView::refresh() noexcept {
  if (plc_image_read(&image_->image(), scratch_.data(), nullptr) != PLC_IMAGE_OK) return;
  for (const ByteRange own : writes_.own) {
    std::memcpy(scratch_.data() + own.offset, bytes_.data() + own.offset, own.bytes);
  }
  std::memcpy(bytes_.data(), scratch_.data(), bytes_.size());
}

void OutputView::begin_cycle() noexcept {
  if (writes_.sole) return;
  // A value that is not out yet is still a change.
  if (late_) return;
  if (image_ != nullptr) refresh();
  for (const ByteRange shared : writes_.shared) {
    std::memcpy(base_.data() + shared.offset, bytes_.data() + shared.offset, shared.bytes);
  }
}

void OutputView::lay_over(std::span<std::byte> target) const noexcept {
  for (const ByteRange own : writes_.own) {
    std::memcpy(target.data() + own.offset, bytes_.data() + own.offset, own.bytes);
  }
  for (const ByteRange shared : writes_.shared) {
    for (std::size_t at = shared.offset; at < shared.offset + shared.bytes; ++at) {
      if (bytes_[at] != base_[at]) target[at] = bytes_[at];
    }
  }
}

void OutputView::end_cycle() noexcept {
  if (image_ != nullptr) {
    if (writes_.sole) return image_->write(bytes_);
    late_ = !image_->merge(scratch_, [this](std::span<std::byte> target) { lay_over(target); });
    if (late_) missed_.store(missed() + 1, std::memory_order_relaxed);
    return;
  }
  if (registers_.empty()) return;
  for (const ByteRange own : writes_.own) copy_to_registers(part(registers_, own), part(bytes_, own));
  for (const ByteRange shared : writes_.shared) {
    for (std::size_t at = shared.offset; at < shared.offset + shared.bytes; ++at) {
      if (bytes_[at] != base_[at]) write_byte(&registers_[at], &bytes_[at]);
    }
  }
}

}  // namespace plchost
