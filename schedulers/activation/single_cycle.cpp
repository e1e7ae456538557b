#include "schedulers/activation/single_cycle.hpp"

namespace plchost {

class SingleCycle::Source final : public ActivationSource {
 public:
  Source(SingleCycle& round, std::size_t link) noexcept : round_(round), link_(link) {}

  // The second call is the end of the task's cycle.
  std::optional<Activation> wait() noexcept override {
    if (ran_) round_.came_back(link_);
    Link& link = *round_.links_[link_];
    if (link.gate.wait(round_.clock_) != ActivationGate::Outcome::opened) return std::nullopt;
    ran_ = true;
    link.begun.store(true, std::memory_order_release);
    return Activation{.release = TimePoint(Duration(link.released_at.load(std::memory_order_relaxed))),
                      .single_cycle = true};
  }
  void interrupt() noexcept override { round_.links_[link_]->gate.interrupt(round_.clock_); }

 private:
  SingleCycle& round_;
  std::size_t link_;
  bool ran_ = false;  // the task's thread only
};

std::unique_ptr<ActivationSource> SingleCycle::add() {
  links_.push_back(std::make_unique<Link>());
  return std::make_unique<Source>(*this, links_.size() - 1);
}

void SingleCycle::begin() noexcept {
  if (!links_.empty()) release(0);
}

void SingleCycle::release(std::size_t link) noexcept {
  links_[link]->released_at.store(clock_.now().time_since_epoch().count(), std::memory_order_relaxed);
  links_[link]->gate.open(clock_);
}

void SingleCycle::came_back(std::size_t link) noexcept {
  std::size_t expected = link;
  if (!turn_.compare_exchange_strong(expected, link + 1, std::memory_order_acq_rel)) return;
  if (link + 1 < links_.size()) release(link + 1);
}

}  // namespace plchost
