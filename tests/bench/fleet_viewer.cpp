// A client that waits until it has seen a number of hosts: presence and status of each. Prints the
// nanoseconds since its start until it saw the first host, and until it saw the last one.
//   plchost-bench-viewer DOMAIN INTERFACE HOSTS SECONDS

#include <cstddef>
#include <cstdlib>
#include <span>
#include <string>

#include <fmt/format.h>

#include "api/client/control_client.hpp"

namespace {

using namespace plchost;  // NOLINT(google-build-using-namespace): a program's main file

int look(ControlClient& client, std::size_t wanted, TimePoint began, TimePoint end) {
  std::size_t seen = 0;
  TimePoint first;
  for (std::uint64_t changes = 0;;) {
    // A look at all hosts for each presence would cost more than the presences.
    if (const std::uint64_t now = client.changes(); now != changes) {
      changes = now;
      const std::size_t before = seen;
      seen = client.hosts(MonotonicClock::now()).size();
      if (before == 0 && seen > 0) first = MonotonicClock::now();
    }
    const TimePoint now = MonotonicClock::now();
    if (seen >= wanted) {
      fmt::print("{} {}\n", (first - began).count(), (now - began).count());
      return 0;
    }
    if (now >= end) {
      fmt::print(stderr, "plchost-bench-viewer: {} of {} hosts were seen\n", seen, wanted);
      return 1;
    }
    client.wait_for_change(end);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const TimePoint began = MonotonicClock::now();
  const std::span arguments(argv, static_cast<std::size_t>(argc));
  constexpr std::size_t kArguments = 5;
  if (arguments.size() != kArguments) {
    fmt::print(stderr, "usage: plchost-bench-viewer DOMAIN INTERFACE HOSTS SECONDS\n");
    return 2;
  }
  dds::DomainOptions options;
  options.domain = static_cast<std::uint32_t>(std::atoi(arguments[1]));
  options.interfaces = {arguments[2]};
  const auto client = ControlClient::connect(options);
  if (!client) {
    fmt::print(stderr, "plchost-bench-viewer: {}\n", client.error().describe());
    return 1;
  }
  return look(**client, static_cast<std::size_t>(std::atoi(arguments[3])), began,
              began + std::chrono::seconds(std::atoi(arguments[4])));
}
