#include "tests/bench/network_space.hpp"

#include <cerrno>
#include <fstream>
#include <iterator>
#include <sstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include "shm/base/system_call.hpp"

namespace plchost::bench {

namespace {

Result<UniqueFd> space_of_this_thread() {
  PLCHOST_TRY_ASSIGN(const int fd, check_errno(::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC),
                                               "open the network namespace"));
  return UniqueFd(fd);
}

}  // namespace

Result<Traffic> parse_traffic(std::string_view text, std::string_view interface) {
  constexpr int kUnusedOfReceived = 6;  // errors, drops ... of /proc/net/dev, before what was sent
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    const auto colon = line.find(':');
    const auto begin = line.find_first_not_of(' ');
    if (colon == std::string::npos || line.substr(begin, colon - begin) != interface) continue;
    std::istringstream fields(line.substr(colon + 1));
    Traffic traffic;
    fields >> traffic.received_bytes >> traffic.received_datagrams;
    double unused = 0;
    for (int i = 0; i < kUnusedOfReceived; ++i) fields >> unused;
    if (fields >> traffic.sent_bytes >> traffic.sent_datagrams) return traffic;
    return failure(ErrorCode::corrupt, fmt::format("counters of interface {}: '{}'", interface, line));
  }
  return failure(ErrorCode::not_found, fmt::format("no interface '{}' here", interface));
}

Result<NetworkSpace> NetworkSpace::create() {
  PLCHOST_TRY_ASSIGN(auto home, space_of_this_thread());
  if (::unshare(CLONE_NEWNET) != 0)
    return failure(ErrorCode::refused, "make a network namespace (it needs CAP_SYS_ADMIN)", errno);
  const Visit visit(std::move(home));
  PLCHOST_TRY_ASSIGN(auto made, space_of_this_thread());
  return NetworkSpace(std::move(made));
}

std::string NetworkSpace::path() const {
  return fmt::format("/proc/{}/fd/{}", ::getpid(), space_.get());
}

Result<NetworkSpace::Visit> NetworkSpace::enter() const {
  PLCHOST_TRY_ASSIGN(auto home, space_of_this_thread());
  PLCHOST_TRY(check_errno(::setns(space_.get(), CLONE_NEWNET), "enter a network namespace"));
  return Visit(std::move(home));
}

NetworkSpace::Visit::~Visit() {
  if (home_) (void)::setns(home_.get(), CLONE_NEWNET);
}

Result<Traffic> NetworkSpace::traffic(std::string_view interface) const {
  PLCHOST_TRY_ASSIGN(const auto visit, enter());
  std::ifstream file("/proc/thread-self/net/dev");
  return parse_traffic(std::string(std::istreambuf_iterator<char>(file), {}), interface);
}

}  // namespace plchost::bench
