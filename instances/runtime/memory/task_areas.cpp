#include "instances/runtime/memory/task_areas.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace plchost {

namespace {

std::span<std::byte> part(std::span<std::byte> all, ByteRange range) noexcept {
  return all.subspan(range.offset, range.bytes);
}

}  // namespace

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

OutputView::OutputView(std::vector<std::byte> initial, Writes writes, OutputRegisters& registers)
    : bytes_(std::move(initial)), base_(bytes_), writes_(std::move(writes)), registers_(&registers) {}

// All but its own bytes, of which it knows more than anybody, and changes that are not out yet. These are of
// a cycle that was too late, or were written by an operator between the cycles.
void OutputView::refresh() noexcept {
  if (!image_->read_latest(scratch_)) return;
  for (const ByteRange own : writes_.own) {
    std::memcpy(scratch_.data() + own.offset, bytes_.data() + own.offset, own.bytes);
  }
  for (const ByteRange shared : writes_.shared) {
    const bool has_changes =
        std::memcmp(bytes_.data() + shared.offset, base_.data() + shared.offset, shared.bytes) != 0;
    for (std::size_t at = shared.offset; has_changes && at < shared.offset + shared.bytes; ++at) {
      const std::byte latest = scratch_[at];
      if (bytes_[at] != base_[at]) scratch_[at] = bytes_[at];
      base_[at] = latest;
    }
    if (!has_changes) std::ranges::copy(part(scratch_, shared), part(base_, shared).begin());
  }
  std::memcpy(bytes_.data(), scratch_.data(), bytes_.size());
}

// Registers cannot be read back: there each task knows its own changes only.
void OutputView::begin_cycle() noexcept {
  if (!writes_.sole && image_ != nullptr) refresh();
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
  // Pairs with the seat of the task: either this sees it, or the task is seen within its cycle.
  if (given_up_.load(std::memory_order_seq_cst)) return;
  if (registers_ != nullptr) return write_registers();
  if (image_ == nullptr) return;
  if (writes_.sole) {
    image_->write(bytes_);
  } else {
    const bool is_out = image_->merge(scratch_, [this](std::span<std::byte> target) { lay_over(target); });
    if (!is_out) return missed_.store(missed() + 1, std::memory_order_relaxed);
    for (const ByteRange shared : writes_.shared)
      std::ranges::copy(part(bytes_, shared), part(base_, shared).begin());
  }
  image_->published();
}

void OutputView::write_registers() noexcept {
  const bool off = registers_->off();
  if (!off) {
    for (const ByteRange own : writes_.own) registers_->write(own.offset, part(bytes_, own));
  }
  // The first cycle since a start also puts out what nobody changes: the registers have other values yet.
  const bool restores = !off && armed_.exchange(false, std::memory_order_relaxed);
  if (note_changes()) OutputRegisters::publish();
  for (const ByteRange shared : writes_.shared) {
    if (restores) {
      registers_->restore(shared);
    } else {
      write_changes(shared);
    }
    std::ranges::copy(part(bytes_, shared), part(base_, shared).begin());
  }
}

bool OutputView::note_changes() noexcept {
  bool has_changed = false;
  for (const ByteRange shared : writes_.shared) {
    for (std::size_t at = shared.offset; at < shared.offset + shared.bytes; ++at) {
      if (bytes_[at] == base_[at]) continue;
      registers_->note(at, bytes_[at]);
      has_changed = true;
    }
  }
  return has_changed;
}

void OutputView::write_changes(ByteRange shared) noexcept {
  for (std::size_t at = shared.offset; at < shared.offset + shared.bytes; ++at) {
    if (bytes_[at] != base_[at] && !registers_->off()) registers_->write(at, std::span(&bytes_[at], 1));
  }
}

}  // namespace plchost
