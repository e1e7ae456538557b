#include "shm/pool/pool_journal.hpp"

#include <algorithm>

namespace plchost {

namespace {

constexpr unsigned kPlaceShift = 32;

// A thread that is killed has done all that stands before the instruction which it did not come to. The
// kernel lets others see it before they see the end of the thread. So only the compiler is to be held back.
void keep_order() noexcept {
  std::atomic_signal_fence(std::memory_order_seq_cst);
}

}  // namespace

void PoolJournal::set(std::atomic<std::uint32_t>& word, std::uint32_t value) noexcept {
  if (noted_ < header_.notes.size()) {
    const auto place = static_cast<std::uint64_t>(&word - reinterpret_cast<Link*>(&header_));
    header_.notes[noted_].store(place << kPlaceShift | word.load(kRelaxed), kRelaxed);
    keep_order();
    header_.noted.store(++noted_, kRelaxed);
  } else {
    header_.rebuilding.store(1, kRelaxed);  // more than can be undone
  }
  keep_order();
  word.store(value, std::memory_order_release);
}

void PoolJournal::commit() noexcept {
  keep_order();
  header_.noted.store(0, kRelaxed);
  keep_order();
  if (noted_ == header_.notes.size()) header_.rebuilding.store(0, kRelaxed);
  noted_ = 0;
}

// Where links, counts and states are: nothing of the header's that is not guarded.
std::atomic<std::uint32_t>* PoolJournal::word_of(std::uint64_t note) const noexcept {
  const std::uint64_t place = note >> kPlaceShift;
  constexpr std::uint64_t kGuarded = offsetof(PoolHeader, high_water) / sizeof(Link);
  constexpr std::uint64_t kNotes = offsetof(PoolHeader, noted) / sizeof(Link);
  constexpr std::uint64_t kTables = kClientsOffset / sizeof(Link);
  const bool guarded =
      (place >= kGuarded && place < kNotes) || (place >= kTables && place < size_ / sizeof(Link));
  return guarded ? reinterpret_cast<Link*>(&header_) + place : nullptr;
}

bool PoolJournal::roll_back() noexcept {
  const std::uint32_t noted = header_.noted.load(kRelaxed);
  if (noted > header_.notes.size()) return false;
  const auto sound = [this](const auto& note) { return word_of(note.load(kRelaxed)) != nullptr; };
  if (!std::all_of(header_.notes.begin(), header_.notes.begin() + noted, sound)) return false;
  // If this process is killed here, the next one rolls back the same notes.
  for (std::uint32_t i = noted; i-- > 0;) {
    const std::uint64_t note = header_.notes[i].load(kRelaxed);
    Link* const word = word_of(note);
    if (word == nullptr) return false;
    word->store(static_cast<std::uint32_t>(note), std::memory_order_release);
  }
  noted_ = 0;
  commit();
  return true;
}

}  // namespace plchost
