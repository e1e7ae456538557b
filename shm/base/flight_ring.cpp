#include "shm/base/flight_ring.hpp"

namespace plchost {

std::string_view to_string(FlightKind kind) noexcept {
  switch (kind) {
    case FlightKind::none:
      break;
    case FlightKind::start:
      return "start";
    case FlightKind::end:
      return "end";
    case FlightKind::lost:
      return "lost";
    case FlightKind::taken:
      return "taken";
    case FlightKind::posted:
      return "posted";
    case FlightKind::moved:
      return "moved";
    case FlightKind::work:
      return "work";
    case FlightKind::halted:
      return "halted";
    case FlightKind::resumed:
      return "resumed";
    case FlightKind::fault:
      return "fault";
    case FlightKind::started:
      return "started";
    case FlightKind::stopping:
      return "stopping";
    case FlightKind::switched:
      return "switched";
    case FlightKind::held:
      return "held";
    case FlightKind::late:
      return "late";
    case FlightKind::struck:
      return "struck";
    case FlightKind::polled:
      return "polled";
  }
  return "unknown";
}

}  // namespace plchost
