#pragma once

#include <list>

#include "api/client/pump.hpp"

namespace plchost {

/// Operations that go one after the other, in the order in which they have asked for it. However many wait,
/// only the next one is let go on.
class Turns {
 public:
  /// One operation's place in the line, until it is destroyed.
  class Turn {
   public:
    Turn(Turns& turns, Pump& pump)
        : line_(turns.line_), hold_(pump), place_(line_.insert(line_.end(), &hold_)) {}
    ~Turn() {
      line_.erase(place_);
      if (!line_.empty()) line_.front()->release();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    [[nodiscard]] bool has_come() const noexcept { return line_.front() == &hold_; }
    /// co_await it while it has not come: until then, or until the deadline.
    [[nodiscard]] Pump::Change come(TimePoint deadline = TimePoint::max()) noexcept {
      return hold_.released(deadline);
    }

   private:
    std::list<Pump::Hold*>& line_;
    Pump::Hold hold_;
    std::list<Pump::Hold*>::iterator place_;
  };

 private:
  std::list<Pump::Hold*> line_;
};

}  // namespace plchost
