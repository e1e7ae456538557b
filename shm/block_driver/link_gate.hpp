#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

namespace plchost {

/// Where real-time threads find a link that a soft thread puts there, exchanges and takes away. The old
/// object goes when no thread is inside any more; no thread ever waits.
template <class Link>
class LinkGate {
 public:
  /// Keeps what it found from going. Real-time.
  class Use {
   public:
    explicit Use(LinkGate& gate) noexcept : gate_(gate) {
      // Before the load, in the one order of all: either the soft thread sees this user, or the user sees
      // what the soft thread has put there.
      gate_.users_.fetch_add(1, std::memory_order_seq_cst);
      link_ = gate_.link_.load(std::memory_order_seq_cst);
    }
    ~Use() { gate_.users_.fetch_sub(1, std::memory_order_release); }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;
    [[nodiscard]] explicit operator bool() const noexcept { return link_ != nullptr; }
    [[nodiscard]] Link* operator->() const noexcept { return link_; }
    [[nodiscard]] Link& operator*() const noexcept { return *link_; }

   private:
    LinkGate& gate_;
    Link* link_;
  };

  /// So many old ones are kept for threads that are inside and do not come out.
  static constexpr std::size_t kMostRetired = 4;

  /// Real-time: the result goes out of use at the end of its block.
  [[nodiscard]] Use enter() noexcept { return Use(*this); }
  [[nodiscard]] bool closed() const noexcept { return link_.load(std::memory_order_relaxed) == nullptr; }

  // The rest is for the one soft thread that owns the gate.

  /// The present object, for its owner; null: none.
  [[nodiscard]] Link* get() const noexcept { return current_.get(); }
  /// Puts `next` (or nothing) in the place of what was there. false: too many are still in use.
  bool exchange(std::unique_ptr<Link> next) {
    collect();
    if (retired_.size() >= kMostRetired) return false;
    link_.store(next.get(), std::memory_order_seq_cst);
    if (current_) retired_.push_back(std::move(current_));
    current_ = std::move(next);
    collect();
    return true;
  }
  /// Frees links that are not used any more.
  void collect() noexcept {
    if (!retired_.empty() && users_.load(std::memory_order_seq_cst) == 0) retired_.clear();
  }

 private:
  std::atomic<Link*> link_{nullptr};
  std::atomic<int> users_{0};
  std::unique_ptr<Link> current_;
  std::vector<std::unique_ptr<Link>> retired_;
};

}  // namespace plchost
