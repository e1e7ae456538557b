#include "tests/models/checker/memory.hpp"

#include <cstring>
#include <stdexcept>

namespace plchost::models {

namespace {

std::uint64_t peek(std::uintptr_t address, std::size_t size) noexcept {
  std::uint64_t value = 0;
  std::memcpy(&value, reinterpret_cast<const void*>(address), size);  // little-endian
  return value;
}

void poke(std::uintptr_t address, std::size_t size, std::uint64_t value) noexcept {
  std::memcpy(reinterpret_cast<void*>(address), &value, size);
}

}  // namespace

void Memory::reset() {
  threads_ = {};
  for (std::size_t i = 0; i < kMaxThreads; ++i)
    threads_[i].now.clock[i] = 1;  // its actions before its first step
  core_of_.fill(-1);
  cores_ = {};
  ended_.reset();
  learnable_.reset();
  for (std::size_t i = 0; i < used_; ++i) locations_[i].order.clear();
  used_ = 0;
  ordered_.clear();
  reaches_.clear();
  cells_.clear();
  cell_table_.assign(cell_table_.size(), 0);
  locks_.clear();
}

template <class Function>
void Memory::each_view(Function use) {
  for (ThreadView& thread : threads_) {
    use(thread.now);
    use(thread.acquired);
    use(thread.released);
  }
  for (View& core : cores_) use(core);
  for (std::size_t i = 0; i < used_; ++i) {
    for (Store& store : locations_[i].order) use(store.released);
  }
  for (Lock& lock : locks_) use(lock.view);
}

std::size_t Memory::index_of(std::uintptr_t address, std::size_t size) {
  for (std::size_t i = 0; i < used_; ++i) {
    if (locations_[i].address != address) continue;
    if (locations_[i].size != size) throw std::logic_error("an atomic is accessed with two sizes");
    return i;
  }
  if (used_ == kMaxLocations) throw std::logic_error("too many atomics");
  if (used_ == locations_.size()) locations_.emplace_back();
  Location& location = locations_[used_];
  location.address = address;
  location.size = size;
  location.order.push_back({.value = peek(address, size), .released = {}});
  return used_++;
}

void Memory::run_on(unsigned thread, unsigned core) {
  core_of_[thread] = static_cast<int>(core);
  core_view(thread).join(threads_[thread].now);
}

// The clock of a thread is odd between its steps, and even in one. A plain access between two steps is known
// to a thread that synchronises with the later one, not with the earlier one.
void Memory::begin_step(unsigned thread) noexcept {
  ThreadView& self = threads_[thread];
  self.now.clock[thread] = static_cast<std::uint16_t>(2U * ++self.step);
  if (core_of_[thread] >= 0) self.now.join(core_view(thread));
}

void Memory::end_step(unsigned thread) noexcept {
  ++threads_[thread].now.clock[thread];
  if (core_of_[thread] >= 0) core_view(thread) = threads_[thread].now;
}

std::size_t Memory::begin(unsigned thread, std::uintptr_t address, std::size_t size) {
  begin_step(thread);
  const std::size_t at = index_of(address, size);
  std::vector<Store>& order = locations_[at].order;
  if (const std::uint64_t value = peek(address, size); value != order.back().value) {
    // Somebody has made another object there without an atomic access.
    order.assign(1, {.value = value, .released = {}});
    each_view([at](View& view) { view.rank[at] = 0; });
    for (Ordered& access : ordered_) {
      if (access.location == at) access.read = access.wrote = -1;
    }
  }
  return at;
}

std::vector<unsigned>& Memory::readable(unsigned thread, std::size_t at, Order order) {
  candidates_.clear();
  const auto last = static_cast<unsigned>(locations_[at].order.size());
  const unsigned first = threads_[thread].now.rank[at];
  for (unsigned rank = last; rank-- > first;) {  // the latest first
    if (order == Order::seq_cst && !fits({.thread = thread,
                                          .clock = threads_[thread].now.clock[thread],
                                          .location = at,
                                          .read = static_cast<int>(rank)})) {
      continue;
    }
    candidates_.push_back(rank);
  }
  return candidates_;
}

// Ranks of stores that a store, or a read-modify-write that has read it, may follow at once. Its own write is
// taken for half a rank above.
std::vector<unsigned>& Memory::replaceable(unsigned thread, std::size_t at, Order order) {
  candidates_.clear();
  const std::vector<Store>& stores = locations_[at].order;
  const unsigned first = threads_[thread].now.rank[at];
  for (auto rank = static_cast<unsigned>(stores.size()); rank-- > first;) {
    if (stores[rank].replaced_at_once) continue;
    if (order == Order::seq_cst && rank + 1 < stores.size()) continue;  // see README.md: the latest only
    candidates_.push_back(rank);
  }
  return candidates_;
}

void Memory::read(unsigned thread, std::size_t at, unsigned rank, Order order) {
  ThreadView& self = threads_[thread];
  const Store& store = locations_[at].order[rank];
  self.now.rank[at] = static_cast<std::uint8_t>(rank);
  self.acquired.join(store.released);
  if (acquires(order)) self.now.join(store.released);
}

std::uint64_t Memory::load(unsigned thread, std::uintptr_t address, std::size_t size, Order order) {
  const std::size_t at = begin(thread, address, size);
  const std::vector<unsigned>& from = readable(thread, at, order);
  const unsigned rank = from[chooser_.choose(static_cast<unsigned>(from.size()))];
  read(thread, at, rank, order);
  if (order == Order::seq_cst) {
    add({.thread = thread,
         .clock = threads_[thread].now.clock[thread],
         .location = at,
         .read = static_cast<int>(rank)});
  }
  end_step(thread);
  return locations_[at].order[rank].value;
}

void Memory::make_room(std::size_t at, unsigned rank) {
  if (locations_[at].order.size() >= 250) throw std::logic_error("too many stores to one atomic");
  if (rank == locations_[at].order.size()) return;
  each_view([at, rank](View& view) {
    if (view.rank[at] >= rank) ++view.rank[at];
  });
  for (Ordered& access : ordered_) {
    if (access.location != at) continue;
    if (access.read >= static_cast<int>(rank)) ++access.read;
    if (access.wrote >= static_cast<int>(rank)) ++access.wrote;
  }
}

// `rank`: of the new store.
void Memory::insert(unsigned thread, std::size_t at, unsigned rank, Order order, std::uint64_t value) {
  make_room(at, rank);
  Location& location = locations_[at];
  ThreadView& self = threads_[thread];
  self.now.rank[at] = static_cast<std::uint8_t>(rank);
  Store store{.value = value, .released = releases(order) ? self.now : self.released};
  store.released.rank[at] = static_cast<std::uint8_t>(rank);
  location.order.insert(location.order.begin() + rank, store);
  if (rank + 1 == location.order.size()) poke(location.address, location.size, value);
}

void Memory::store(unsigned thread, std::uintptr_t address, std::size_t size, Order order,
                   std::uint64_t value) {
  const std::size_t at = begin(thread, address, size);
  const std::vector<unsigned>& after = replaceable(thread, at, order);
  const unsigned rank = after[chooser_.choose(static_cast<unsigned>(after.size()))] + 1;
  insert(thread, at, rank, order, value);
  if (order == Order::seq_cst) {
    add({.thread = thread,
         .clock = threads_[thread].now.clock[thread],
         .location = at,
         .wrote = static_cast<int>(rank)});
  }
  end_step(thread);
}

void Memory::replace(unsigned thread, std::size_t at, unsigned rank, Order order, std::uint64_t value) {
  read(thread, at, rank, order);
  const View passed_on = locations_[at].order[rank].released;  // the release sequence goes on
  insert(thread, at, rank + 1, order, value);
  locations_[at].order[rank].replaced_at_once = true;
  locations_[at].order[rank + 1].released.join(passed_on);
  if (order == Order::seq_cst) {
    add({.thread = thread,
         .clock = threads_[thread].now.clock[thread],
         .location = at,
         .read = static_cast<int>(rank),
         .wrote = static_cast<int>(rank + 1)});
  }
  end_step(thread);
}

bool Memory::compare_exchange(unsigned thread, std::uintptr_t address, std::size_t size, Order success,
                              Order failure, std::uint64_t& expected, std::uint64_t value) {
  const std::size_t at = begin(thread, address, size);
  const std::vector<Store>& stores = locations_[at].order;
  std::vector<unsigned> from;
  for (const unsigned rank : readable(thread, at, failure)) {
    if (stores[rank].value != expected) from.push_back(rank);
  }
  for (const unsigned rank : replaceable(thread, at, success)) {
    if (stores[rank].value == expected) from.push_back(rank);
  }
  std::ranges::sort(from, std::greater{});
  const unsigned rank = from[chooser_.choose(static_cast<unsigned>(from.size()))];
  if (stores[rank].value == expected) {
    replace(thread, at, rank, success, value);
    return true;
  }
  expected = stores[rank].value;
  read(thread, at, rank, failure);
  if (failure == Order::seq_cst) {
    add({.thread = thread,
         .clock = threads_[thread].now.clock[thread],
         .location = at,
         .read = static_cast<int>(rank)});
  }
  end_step(thread);
  return false;
}

void Memory::fence(unsigned thread, Order order) {
  ThreadView& self = threads_[thread];
  begin_step(thread);
  if (acquires(order)) self.now.join(self.acquired);
  if (releases(order)) self.released = self.now;
  end_step(thread);
}

// `before` and `after`: the accesses that the total order of the seq_cst ones has before and after it.
bool Memory::fits(const Ordered& access, Events& before, Events& after) const {
  for (std::size_t i = 0; i < ordered_.size(); ++i) {
    const Ordered& other = ordered_[i];
    if (threads_[access.thread].now.clock[other.thread] >= other.clock) before.set(i);
    if (other.location != access.location) continue;
    const bool overwritten = other.wrote >= 0 && access.read >= 0 && access.read < other.wrote;
    if (overwritten) after.set(i);
    const int newest = std::max(other.read, other.wrote);
    if (access.wrote >= 0 && newest >= 0) (newest < access.wrote ? before : after).set(i);
  }
  Events later = after;
  for (std::size_t i = 0; i < ordered_.size(); ++i) {
    if (after.test(i)) later |= reaches_[i];
  }
  after = later;
  return (before & after).none();
}

bool Memory::fits(const Ordered& access) const {
  Events before;
  Events after;
  return fits(access, before, after);
}

void Memory::add(const Ordered& access) {
  if (ordered_.size() == kMaxOrdered) throw std::logic_error("too many seq_cst accesses");
  Events before;
  Events after;
  (void)fits(access, before, after);
  const std::size_t self = ordered_.size();
  ordered_.push_back(access);
  reaches_.push_back(after);
  for (std::size_t i = 0; i < self; ++i) {
    if (!before.test(i) && (reaches_[i] & before).none()) continue;
    reaches_[i] |= after;
    reaches_[i].set(self);
  }
}

std::size_t Memory::size_of(std::uintptr_t address, std::size_t otherwise) const noexcept {
  for (std::size_t i = 0; i < used_; ++i) {
    if (locations_[i].address == address) return locations_[i].size;
  }
  return otherwise;
}

void Memory::catch_up(unsigned thread) noexcept {
  for (std::size_t i = 0; i < used_; ++i)
    threads_[thread].now.rank[i] = static_cast<std::uint8_t>(locations_[i].order.size() - 1);
}

void Memory::pass_lock(unsigned thread, std::uintptr_t address) {
  ThreadView& self = threads_[thread];
  begin_step(thread);
  auto lock = std::ranges::find(locks_, address, &Lock::address);
  if (lock == locks_.end()) lock = locks_.insert(lock, {.address = address, .view = {}});
  self.now.join(lock->view);
  lock->view = self.now;
  end_step(thread);
}

auto Memory::cell(std::uintptr_t address) -> Cell& {
  constexpr std::size_t kTable = 1U << 14U;
  if (cell_table_.empty()) cell_table_.resize(kTable);
  for (std::size_t i = address * 0x9e3779b97f4a7c15U >> 50U;; i = (i + 1) % kTable) {
    if (cell_table_[i] == 0) {
      if (cells_.size() > kTable / 2) throw std::logic_error("too much plain memory");
      cells_.push_back({.address = address});
      cell_table_[i] = static_cast<std::uint32_t>(cells_.size());
    }
    Cell& found = cells_[cell_table_[i] - 1];
    if (found.address == address) return found;
  }
}

bool Memory::plain_read(unsigned thread, std::uintptr_t address, std::size_t size) {
  const auto& clock = threads_[thread].now.clock;
  bool good = true;
  for (std::uintptr_t at = address / 4; at <= (address + size - 1) / 4; ++at) {
    Cell& memory = cell(at);
    good = good && memory.written <= clock[memory.writer];
    memory.read[thread] = clock[thread];
  }
  return good;
}

bool Memory::plain_write(unsigned thread, std::uintptr_t address, std::size_t size) {
  const auto& clock = threads_[thread].now.clock;
  bool good = true;
  for (std::uintptr_t at = address / 4; at <= (address + size - 1) / 4; ++at) {
    Cell& memory = cell(at);
    good = good && memory.written <= clock[memory.writer];
    for (std::size_t i = 0; i < kMaxThreads; ++i) good = good && memory.read[i] <= clock[i];
    memory.writer = static_cast<std::uint8_t>(thread);
    memory.written = clock[thread];
  }
  return good;
}

}  // namespace plchost::models
