#include "tests/models/checker/memory.hpp"

namespace plchost::models {

// A thread sees in its next step all that was done on its core.
const View& Memory::seen_by(std::size_t thread) const noexcept {
  const int core = core_of_[thread];
  return core < 0 ? threads_[thread].now : cores_[static_cast<std::size_t>(core)];
}

// The oldest store that any thread can still read. All stores before it can be forgotten.
unsigned Memory::oldest_readable(std::size_t at) const {
  unsigned oldest = ~0U;
  for (std::size_t i = 0; i < kMaxThreads; ++i) {
    if (!ended_.test(i)) oldest = std::min<unsigned>(oldest, seen_by(i).rank[at]);
  }
  return std::min<unsigned>(oldest, static_cast<unsigned>(locations_[at].order.size()) - 1);
}

// Of everything that the rest of the execution depends on. Locations have the order of their first use, which
// depends on the interleaving, so they are summed up. Two states of one hash are taken for the same.
std::uint64_t Memory::hash() const {
  std::array<unsigned, kMaxLocations> base{};
  for (std::size_t i = 0; i < used_; ++i) base[i] = oldest_readable(i);
  std::array<std::uint16_t, kMaxThreads> known{};  // of each thread: so much is known to all
  for (std::size_t i = 0; i < kMaxThreads; ++i) {
    known[i] = 0xffff;
    for (std::size_t t = 0; t < kMaxThreads; ++t) {
      if (!ended_.test(t)) known[i] = std::min(known[i], seen_by(t).clock[i]);
    }
  }
  const auto hash_of = [&](const View& view, std::uint64_t what) {
    std::uint64_t sum = what;
    for (std::size_t i = 0; i < used_; ++i) {
      if (view.rank[i] > base[i])
        sum += mix(mix(what, locations_[i].address), view.rank[i] - std::uint64_t{base[i]});
    }
    for (std::size_t i = 0; i < kMaxThreads; ++i) {
      if (view.clock[i] > known[i]) sum += mix(mix(what, i + 1), view.clock[i]);
    }
    return sum;
  };
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < kMaxThreads; ++i) {
    if (ended_.test(i) && !learnable_.test(i)) continue;
    const ThreadView& thread = threads_[i];
    const std::uint64_t self = mix(0x7468, i);
    sum += mix(mix(self, thread.step), hash_of(seen_by(i), self));
    if (ended_.test(i)) continue;
    View acquired = thread.acquired;
    acquired.join(seen_by(i));
    sum += mix(hash_of(acquired, self + 1), hash_of(thread.released, self + 2));
  }
  for (std::size_t i = 0; i < used_; ++i) {
    const Location& location = locations_[i];
    std::uint64_t stores = mix(location.address, location.size);
    for (std::size_t rank = base[i]; rank < location.order.size(); ++rank) {
      const Store& store = location.order[rank];
      stores = mix(mix(stores, store.value), hash_of(store.released, store.replaced_at_once ? 5 : 3));
    }
    sum += stores;
  }
  for (std::size_t i = 0; i < ordered_.size(); ++i) {
    const Ordered& access = ordered_[i];
    // Nothing can come before it in the total order any more, unless it has read or written what is recent.
    const int read = access.read - static_cast<int>(base[access.location]);
    const int wrote = access.wrote - static_cast<int>(base[access.location]);
    if (read <= 0 && wrote <= 0) continue;
    std::uint64_t self = mix(mix(access.thread, access.clock), locations_[access.location].address);
    self = mix(mix(self, static_cast<std::uint64_t>(std::max(read, 0))),
               static_cast<std::uint64_t>(std::max(wrote, 0)));
    sum += self;
    for (std::size_t k = 0; k < ordered_.size(); ++k) {
      if (reaches_[i].test(k)) sum += mix(mix(self, ordered_[k].thread), ordered_[k].clock);
    }
  }
  for (const Cell& cell : cells_) {
    bool recent = cell.written > known[cell.writer];
    std::uint64_t self = mix(mix(cell.address, cell.writer), cell.written);
    for (std::size_t i = 0; i < kMaxThreads; ++i) {
      recent = recent || cell.read[i] > known[i];
      self = mix(self, cell.read[i]);
    }
    if (recent) sum += self;
  }
  for (const Lock& lock : locks_) sum += hash_of(lock.view, mix(0x6c6f, lock.address));
  return sum;
}

}  // namespace plchost::models
