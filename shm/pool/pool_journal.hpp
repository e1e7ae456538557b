#pragma once

#include <atomic>
#include <cstdint>

#include "shm/pool/pool_layout.hpp"

namespace plchost {

/// How the words that the pool's mutex guards are written: the old values are noted in the header first. The
/// next process that takes the mutex of a killed one puts those back. So the unfinished step of the killed
/// one has not happened: in a time that does not depend on the number of objects. All functions need the
/// mutex.
///
/// Words that are read only after a noted one are not written this way: the contents of a free place. Nor are
/// generations: that of an object may grow without a reason.
class PoolJournal {
 public:
  /// `size` bytes from the header on are the pool's segment.
  PoolJournal(PoolHeader& header, std::size_t size) noexcept : header_(header), size_(size) {}

  void set(std::atomic<std::uint32_t>& word, std::uint32_t value) noexcept;
  /// All changes up to here stay.
  void commit() noexcept;
  /// Puts back what was changed since the last commit(). false, and nothing is done: a stranger has written
  /// over what was noted.
  [[nodiscard]] bool roll_back() noexcept;

 private:
  [[nodiscard]] std::atomic<std::uint32_t>* word_of(std::uint64_t note) const noexcept;

  PoolHeader& header_;
  std::size_t size_;
  std::uint32_t noted_ = 0;  // since the last commit(); a shared one could be a stranger's
};

}  // namespace plchost
