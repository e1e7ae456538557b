#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>

#include "api/client/pump.hpp"

namespace plchost {

/// Operations that go one after the other, in the order in which they have asked for it.
class Turns {
 public:
  /// One operation's place in the line, until it is destroyed.
  class Turn {
   public:
    Turn(Turns& turns, Pump& pump) : turns_(turns), pump_(pump), number_(++turns.last_) {
      turns_.line_.push_back(number_);
    }
    ~Turn() {
      std::erase(turns_.line_, number_);
      pump_.look_again();
    }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    [[nodiscard]] bool has_come() const noexcept { return turns_.line_.front() == number_; }

   private:
    Turns& turns_;
    Pump& pump_;
    std::uint64_t number_;
  };

 private:
  std::deque<std::uint64_t> line_;
  std::uint64_t last_ = 0;
};

}  // namespace plchost
