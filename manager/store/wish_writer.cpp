#include "manager/store/wish_writer.hpp"

#include <array>
#include <charconv>
#include <csignal>
#include <filesystem>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/epoll.h>

#include "manager/store/exception_folder.hpp"
#include "manager/store/wish_folder.hpp"
#include "manager/system/take_packets.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/read_plain_file.hpp"
#include "shm/files/replace_file.hpp"

namespace plchost {

namespace {

constexpr char kBetween = '\0';  // no path has it
constexpr mode_t kWishMode = 0600;

std::uint64_t number_of(std::string_view text) {
  std::uint64_t number = 0;
  (void)std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

// The first four parts, and the rest.
std::array<std::string, 5> parts_of(std::string_view packet) {
  std::array<std::string, 5> parts;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::size_t end = i + 1 < parts.size() ? packet.find(kBetween) : std::string_view::npos;
    parts[i] = packet.substr(0, end);
    packet.remove_prefix(end == std::string_view::npos ? packet.size() : end + 1);
  }
  return parts;
}

// An instance has written it, which may be another user: a link could lead to a file of ours.
Result<std::string> read_events(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 18;  // 4096 names
  return read_plain_file(path, kMostBytes);
}

Result<void> carry_out_order(const WishOrder& order) {
  if (order.kind == WishOrder::Kind::exceptions) return keep_exceptions_on_disk(order.path, order.from);
  const std::filesystem::path path(order.path);
  if (auto made = make_wish_folder(path.parent_path()); !made) return made;
  std::error_code error;
  if (!order.from.empty() && !std::filesystem::exists(order.from, error)) {
    std::filesystem::remove(path, error);
    if (error) return failure(ErrorCode::system, "cannot remove " + order.path, error.value());
    return sync_directory(path.parent_path());
  }
  std::string text = order.text;
  if (!order.from.empty()) {
    PLCHOST_TRY_ASSIGN(text, read_events(order.from));
  }
  if (auto written = replace_file(order.path, text, kWishMode); !written) return written;
  return sync_directory(path.parent_path());
}

}  // namespace

Result<void> WishWriter::write(const WishOrder& order, Done done) {
  if (!link_) {
    if (auto started = start(); !started) return started;
  }
  const std::uint64_t number = ++last_number_;
  if (auto sent =
          link_.send(fmt::format("{}{}{}{}{}{}{}{}{}", number, kBetween, std::to_underlying(order.kind),
                                 kBetween, order.path, kBetween, order.from, kBetween, order.text));
      !sent) {
    return sent;
  }
  waiting_.emplace(number, std::move(done));
  return {};
}

Result<void> WishWriter::start() {
  if (process_) return failure(ErrorCode::busy, "the helper that writes to the disk is ending");
  PLCHOST_TRY_ASSIGN(auto channel, make_report_channel());
  PLCHOST_TRY_ASSIGN(auto process, spawn_process({.arguments = {helper_, kWishWriterOption},
                                                  .report_fd = channel.childs.get()}));
  auto exit_watch = reactor_.watch(process.pidfd.get(), EPOLLIN, [this](std::uint32_t) { ended(); });
  auto link_watch = reactor_.watch(channel.ours.fd(), EPOLLIN, [this](std::uint32_t) { read_answers(); });
  if (!exit_watch || !link_watch) {
    (void)signal_process(process, SIGKILL);
    return std::unexpected(exit_watch ? link_watch.error() : exit_watch.error());
  }
  process_ = std::move(process);
  exit_watch_ = std::move(*exit_watch);
  link_ = std::move(channel.ours);
  link_watch_ = std::move(*link_watch);
  return {};
}

void WishWriter::read_answers() {
  take_packets(link_, link_watch_, [this](std::string_view packet) {
    const std::size_t end = packet.find(' ');
    const auto found = waiting_.find(number_of(packet.substr(0, end)));
    if (found == waiting_.end()) return;
    const Done done = std::move(found->second);
    waiting_.erase(found);
    const std::string problem(end == std::string_view::npos ? std::string_view() : packet.substr(end + 1));
    done(problem.empty() ? Result<void>() : failure(ErrorCode::system, problem));
  });
}

void WishWriter::ended() {
  read_answers();
  const ExitStatus status = reap_process(*process_);
  exit_watch_.reset();
  link_watch_.reset();
  link_.close();
  process_.reset();
  for (const auto& [number, done] : std::exchange(waiting_, {})) {
    done(failure(ErrorCode::unavailable, "the helper that writes to the disk: " + status.describe()));
  }
}

int wish_writer_main() {
  PacketSocket link{UniqueFd(kChildReportFd)};
  (void)::fcntl(kChildReportFd, F_SETFL, O_NONBLOCK);
  for (;;) {
    pollfd ready{.fd = kChildReportFd, .events = POLLIN, .revents = 0};
    (void)::poll(&ready, 1, -1);
    const auto packet = link.receive();
    if (!packet) return 0;
    if (!*packet) continue;
    const auto [number, kind, path, from, text] = parts_of(**packet);
    const auto done = carry_out_order(
        {.kind = static_cast<WishOrder::Kind>(number_of(kind)), .path = path, .text = text, .from = from});
    constexpr std::size_t kMost = 1000;
    if (!link.send(done ? number : fmt::format("{} {}", number, done.error().describe().substr(0, kMost)))) {
      return 0;
    }
  }
}

}  // namespace plchost
