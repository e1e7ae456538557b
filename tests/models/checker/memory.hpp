#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace plchost::models {

inline constexpr std::size_t kMaxThreads = 5;
inline constexpr std::size_t kMaxLocations = 128;

/// The orders of C++ as the compiler passes them to the functions of instrumented code.
enum class Order : std::uint8_t { relaxed, consume, acquire, release, acq_rel, seq_cst };
[[nodiscard]] constexpr bool acquires(Order order) noexcept {
  return order != Order::relaxed && order != Order::release;
}
[[nodiscard]] constexpr bool releases(Order order) noexcept {
  return order == Order::release || order == Order::acq_rel || order == Order::seq_cst;
}

/// A thread's knowledge: for each location the oldest store that it may still read, as its rank in the
/// modification order, and how far it is synchronised with each thread.
struct View {
  std::array<std::uint8_t, kMaxLocations> rank{};
  std::array<std::uint16_t, kMaxThreads> clock{};

  void join(const View& other) noexcept {
    for (std::size_t i = 0; i < kMaxLocations; ++i) rank[i] = std::max(rank[i], other.rank[i]);
    for (std::size_t i = 0; i < kMaxThreads; ++i) clock[i] = std::max(clock[i], other.clock[i]);
  }
};

struct ThreadView {
  View now;
  View acquired;  ///< the gain of an acquire fence
  View released;  ///< of the last release fence: relaxed stores pass it on
  std::uint16_t step = 0;
};

/// One store to a location. The vector of a location is its modification order.
struct Store {
  std::uint64_t value = 0;
  View released;                  ///< the gain of an acquire that reads it
  bool replaced_at_once = false;  ///< a read-modify-write has read it: nothing comes between the two
};

/// Makes the checker's decisions: 0 <= result < count.
class Chooser {
 public:
  virtual ~Chooser() = default;
  virtual unsigned choose(unsigned count) = 0;
};

/// The memory of one execution, as C++ defines it (RC11 without the promises: a load reads a store that was
/// executed before). Which store a load reads, and where in the modification order a store goes, are choices.
///
/// Views give happens-before and coherence. For seq_cst accesses the graph of their total order is kept; a
/// choice that would close a cycle in it is none. There are no seq_cst fences in the protocols; one is taken
/// for an acquire and release fence, which allows more than C++ does.
class Memory {
 public:
  explicit Memory(Chooser& chooser) noexcept : chooser_(chooser) {}

  /// For a new execution.
  void reset();

  std::uint64_t load(unsigned thread, std::uintptr_t address, std::size_t size, Order order);
  void store(unsigned thread, std::uintptr_t address, std::size_t size, Order order, std::uint64_t value);
  /// `change(old value)` gives the new one. Returns the old one.
  template <class Change>
  std::uint64_t exchange(unsigned thread, std::uintptr_t address, std::size_t size, Order order,
                         Change change) {
    const std::size_t at = begin(thread, address, size);
    std::vector<unsigned>& from = replaceable(thread, at, order);
    const unsigned rank = from[chooser_.choose(static_cast<unsigned>(from.size()))];
    const std::uint64_t old = locations_[at].order[rank].value;
    replace(thread, at, rank, order, change(old));
    return old;
  }
  /// True: `expected` was there, and is replaced; else it tells what was.
  bool compare_exchange(unsigned thread, std::uintptr_t address, std::size_t size, Order success,
                        Order failure, std::uint64_t& expected, std::uint64_t value);
  void fence(unsigned thread, Order order);

  /// A plain access. False: another thread's access may happen at the same time (a data race).
  [[nodiscard]] bool plain_read(unsigned thread, std::uintptr_t address, std::size_t size);
  [[nodiscard]] bool plain_write(unsigned thread, std::uintptr_t address, std::size_t size);

  /// The kernel's lock of a futex: a thread that takes it has the knowledge of the one before it.
  void pass_lock(unsigned thread, std::uintptr_t address);

  /// `thread` shares a core: the kernel's switch to it passes on all that the others have done there.
  void run_on(unsigned thread, unsigned core);

  /// `thread` begins, and knows all that `other` has done.
  void begin_after(unsigned thread, unsigned other) {
    ended_.reset(thread);
    threads_[thread].now.join(threads_[other].now);
    if (core_of_[thread] >= 0) core_view(thread).join(threads_[thread].now);
  }
  /// `thread` has seen that `other` has ended, and knows all that it has done.
  void learn(unsigned thread, unsigned other) { threads_[thread].now.join(threads_[other].now); }
  /// Time has passed: it sees the newest store of each location, and knows nothing more by that.
  void catch_up(unsigned thread) noexcept;
  /// It does nothing more: the stores that it could still read are of no interest.
  void end(unsigned thread, bool may_be_learned = false) noexcept {
    ended_.set(thread);
    learnable_.set(thread, may_be_learned);
  }
  [[nodiscard]] std::uint64_t hash() const;
  /// Bytes of the atomic there; `otherwise` if there was no access to it yet.
  [[nodiscard]] std::size_t size_of(std::uintptr_t address, std::size_t otherwise) const noexcept;
  [[nodiscard]] std::uint16_t steps(unsigned thread) const noexcept { return threads_[thread].step; }

 private:
  struct Location {
    std::uintptr_t address = 0;
    std::size_t size = 0;
    std::vector<Store> order;
  };
  /// A seq_cst access: where in the modification order it has read and written (-1: it has not).
  struct Ordered {
    unsigned thread = 0;
    std::uint16_t clock = 0;
    std::size_t location = 0;
    int read = -1;
    int wrote = -1;
  };
  struct Cell {  // four bytes of plain memory
    std::uintptr_t address = 0;
    std::uint8_t writer = 0;
    std::uint16_t written = 0;  // the writer's clock then
    std::array<std::uint16_t, kMaxThreads> read{};
  };
  struct Lock {
    std::uintptr_t address = 0;
    View view;
  };
  static constexpr std::size_t kMaxOrdered = 256;
  using Events = std::bitset<kMaxOrdered>;

  std::size_t begin(unsigned thread, std::uintptr_t address, std::size_t size);
  [[nodiscard]] std::size_t index_of(std::uintptr_t address, std::size_t size);
  std::vector<unsigned>& readable(unsigned thread, std::size_t at, Order order);
  std::vector<unsigned>& replaceable(unsigned thread, std::size_t at, Order order);
  void read(unsigned thread, std::size_t at, unsigned rank, Order order);
  void replace(unsigned thread, std::size_t at, unsigned rank, Order order, std::uint64_t value);
  void insert(unsigned thread, std::size_t at, unsigned rank, Order order, std::uint64_t value);
  void make_room(std::size_t at, unsigned rank);
  [[nodiscard]] bool fits(const Ordered& access, Events& before, Events& after) const;
  [[nodiscard]] bool fits(const Ordered& access) const;
  void add(const Ordered& access);
  Cell& cell(std::uintptr_t address);
  [[nodiscard]] unsigned oldest_readable(std::size_t at) const;
  template <class Function>
  void each_view(Function use);
  void begin_step(unsigned thread) noexcept;
  void end_step(unsigned thread) noexcept;
  View& core_view(unsigned thread) noexcept { return cores_[static_cast<std::size_t>(core_of_[thread])]; }
  [[nodiscard]] const View& seen_by(std::size_t thread) const noexcept;

  Chooser& chooser_;
  std::array<ThreadView, kMaxThreads> threads_;
  std::array<int, kMaxThreads> core_of_{};  // of a thread; -1: its own
  std::array<View, kMaxThreads> cores_;     // the view of the thread that ran there last
  std::bitset<kMaxThreads> ended_;
  std::bitset<kMaxThreads> learnable_;
  std::vector<Location> locations_;
  std::size_t used_ = 0;
  std::vector<Ordered> ordered_;
  std::vector<Events> reaches_;  // of each seq_cst access: those that come after it
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> cell_table_;
  std::vector<Lock> locks_;
  std::vector<unsigned> candidates_;
};

[[nodiscard]] constexpr std::uint64_t mix(std::uint64_t hash, std::uint64_t value) noexcept {
  hash = (hash ^ value) * 0x9e3779b97f4a7c15U;
  return hash ^ hash >> 29;
}

}  // namespace plchost::models
